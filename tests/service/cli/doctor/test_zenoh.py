# SPDX-License-Identifier: GPL-3.0-or-later
"""zenoh's endpoints and files."""

from pathlib import Path

from service.cli.doctor.network import check_zenoh
from service.settings.zenoh import ZenohSettings
from tests.support.doctor import assert_ok, assert_problem


def test_zenoh_endpoints_and_files_are_checked(tmp_path: Path) -> None:
    assert_ok(check_zenoh(None), "off")
    assert_ok(check_zenoh(ZenohSettings(vehicle="naze-1")), "fleet/naze-1, does not open connections")
    nowhere = ZenohSettings(vehicle="naze-1", connect=("tcp/127.0.0.1:9",))
    assert_ok(check_zenoh(nowhere), "connects to tcp/127.0.0.1:9")
    (tmp_path / "zenoh.json5").write_text("{mode: ")
    broken = ZenohSettings(vehicle="naze-1", config_file=tmp_path / "zenoh.json5")
    assert_problem(check_zenoh(broken), "zenoh.json5", "config_file")

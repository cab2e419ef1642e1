# SPDX-License-Identifier: GPL-3.0-or-later

from pathlib import Path

import pytest

from service.settings import Settings, SettingsError, load_settings


def settings_of(tmp_path: Path, text: str) -> Settings:
    config = tmp_path / "naze.toml"
    config.write_text(text)
    return load_settings(config, fc="sim:", state_dir=tmp_path)


def test_telemetry_is_recorded_by_default(tmp_path: Path) -> None:
    assert settings_of(tmp_path, "").tlog == 256 << 20
    assert settings_of(tmp_path, "tlog_total_mb = 2").tlog == 2 << 20
    assert settings_of(tmp_path, "record_tlog = false\ntlog_total_mb = 3").tlog is None


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("record_tlog = 1", "record_tlog is 1, but must be true or false"),
        ("tlog_total_mb = true", "tlog_total_mb is True, but must be a whole number"),
        ("tlog_total_mb = 0", "tlog_total_mb is 0, but must be 2..1048576"),
        ("tlog_total = 20", "did you mean 'tlog_total_mb'"),
        ("key_file = true", "key_file is True, but must be text in quotes"),
    ],
)
def test_invalid_values_are_refused(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(SettingsError, match=complaint.replace(".", r"\.")):
        settings_of(tmp_path, text)

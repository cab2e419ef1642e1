# SPDX-License-Identifier: GPL-3.0-or-later

from pathlib import Path

import pytest

from service.settings import Settings, SettingsError, TlogLimits, load_settings


def settings_of(tmp_path: Path, text: str) -> Settings:
    config = tmp_path / "naze.toml"
    config.write_text(text)
    return load_settings(config, fc="sim:", state_dir=tmp_path)


def test_telemetry_is_recorded_by_default(tmp_path: Path) -> None:
    assert settings_of(tmp_path, "").tlog == TlogLimits(file_size=16 << 20, total_size=256 << 20, days=30)
    assert settings_of(tmp_path, "record_tlog = false\ntlog_days = 3").tlog is None


def test_the_limits_are_settings(tmp_path: Path) -> None:
    limits = settings_of(tmp_path, "tlog_file_mb = 200\ntlog_days = 365").tlog
    assert limits == TlogLimits(file_size=200 << 20, total_size=400 << 20, days=365)
    limits = settings_of(tmp_path, "tlog_file_mb = 1\ntlog_total_mb = 2\ntlog_days = 1").tlog
    assert limits == TlogLimits(file_size=1 << 20, total_size=2 << 20, days=1)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("record_tlog = 1", "record_tlog is 1, but must be true or false"),
        ("tlog_days = true", "tlog_days is True, but must be a whole number"),
        ("tlog_days = 0", "tlog_days is 0, but must be 1..3650"),
        ("tlog_file_mb = 2000", "tlog_file_mb is 2000, but must be 1..1024"),
        ("tlog_day = 20", "did you mean 'tlog_days'"),
        ("key_file = true", "key_file is True, but must be text in quotes"),
    ],
)
def test_invalid_values_are_refused(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(SettingsError, match=complaint.replace(".", r"\.")):
        settings_of(tmp_path, text)

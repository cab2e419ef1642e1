# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's own settings (bridge/settings/ has the board's). Flags override files, files override defaults."""

from service.settings.key import SettingsError
from service.settings.load import default_state_dir, load_settings, takeoff_limit_m
from service.settings.settings import DEFAULT_GCS, Settings

__all__ = [
    "DEFAULT_GCS",
    "Settings",
    "SettingsError",
    "default_state_dir",
    "load_settings",
    "takeoff_limit_m",
]

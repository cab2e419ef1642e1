# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: flags override the configuration files, which override the defaults."""

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

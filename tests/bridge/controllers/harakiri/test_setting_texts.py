# SPDX-License-Identifier: GPL-3.0-or-later

from bridge.controllers.harakiri.setting_texts import TEXTS
from simulator.naze.setting_table import SETTINGS


def test_every_text_is_of_a_setting() -> None:
    assert TEXTS.keys() <= {held.setting.name for held in SETTINGS}


def test_most_settings_have_a_text() -> None:
    assert len(TEXTS) > 0.6 * len(SETTINGS)

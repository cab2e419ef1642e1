# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations on the board's settings for the command line, the status page and zenoh. Sans-IO."""

from bridge.fc.session import FcSession
from bridge.vehicle.board_settings import READ_WITHIN_S, BoardSettings
from bridge.vehicle.setting_clients import OnTable
from bridge.vehicle.settings_restore import SettingsRestores


class LocalSettings:
    """Reads, changes, saves and restores the settings, by the same rules as parameters from ground stations."""

    def __init__(self, settings: BoardSettings, session: FcSession) -> None:
        self._settings = settings
        self._session = session
        self.change, self.save = settings.change, settings.save
        restores = SettingsRestores(settings, lambda: self.kind)
        self.plan, self.restore = restores.plan, restores.restore

    @property
    def kind(self) -> str | None:
        """The board's firmware and its version; None without a board."""
        controller = self._session.state.controller
        return None if controller is None else controller.kind

    @property
    def is_checked(self) -> bool:
        """True if the settings were read from this board since anything else may have changed them."""
        return self._settings.is_checked

    def read(self, on_done: OnTable, now: float) -> None:
        """The table, checked against the board if that is possible now, else as last read."""
        self._settings.current(on_done, now, READ_WITHIN_S)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts behind the front door of a bridge, for tests that look at one of them."""

from bridge.bridge import Bridge


class Inside:
    """The only place outside bridge/bridge.py that knows the names of its parts."""

    def __init__(self, bridge: Bridge) -> None:
        self.session = bridge._session
        self.runner = bridge._runner
        self.ground = bridge._ground
        self.incoming = bridge._incoming
        self.missions = bridge._missions
        self.uploads = bridge._types.of_missions
        self.sharing = bridge._sharing
        self.board_settings = bridge._board_settings
        self.parameters = bridge._parameters


def inside(bridge: Bridge) -> Inside:
    return Inside(bridge)

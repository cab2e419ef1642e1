# SPDX-License-Identifier: GPL-3.0-or-later
"""The events of the bridge: the log prints them, and other parts act on some. docs/events.md is for users."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Literal, dataclass_transform

Level = Literal["debug", "info", "warning", "error"]


@dataclass_transform(frozen_default=True, kw_only_default=True)
@dataclass(frozen=True, kw_only=True)
class BridgeEvent:
    """An event. The log line has the name, the level, and the fields as facts, with the unit in the key.

    >>> FcLost(why="no answer for 3 s", speed_baud=115200).facts()
    {'why': 'no answer for 3 s', 'speed_baud': 115200}
    """

    name_in_log: ClassVar[str]
    level: Level = "info"

    def __init_subclass__(cls) -> None:
        """Each kind of event below is also a dataclass."""
        dataclass(frozen=True, kw_only=True)(cls)

    def facts(self) -> dict[str, object]:
        facts = vars(self).copy()
        del facts["level"]
        return facts


#: Passes an event to everything that logs it or acts on it.
Emit = Callable[[BridgeEvent], None]


class PortLost(BridgeEvent):
    """The flight controller's port was lost; not sent if the bridge closed it itself."""

    name_in_log = "fc.port_lost"
    level: Level = "warning"
    why: str


class FcSensed(BridgeEvent):
    """A protocol was recognised."""

    name_in_log = "fc.sensed"
    level: Level = "debug"
    speed_baud: int | None
    protocol: str
    why: str


class FcFound(BridgeEvent):
    """The flight controller is identified."""

    name_in_log = "fc.found"
    speed_baud: int | None
    name: str
    kind: str
    protocol: str
    why: str


class FcInCommandLine(BridgeEvent):
    """The flight controller is in the command line, and unusable until the pilot types `exit` there."""

    name_in_log = "fc.in_command_line"
    level: Level = "warning"
    speed_baud: int | None


class FcLost(BridgeEvent):
    """The flight controller no longer replies, or speaks another protocol."""

    name_in_log = "fc.lost"
    level: Level = "warning"
    why: str
    speed_baud: int | None


class Armed(BridgeEvent):
    """The flight controller reports that it is armed."""

    name_in_log = "vehicle.armed"


class Disarmed(BridgeEvent):
    """The flight controller reports that it is disarmed."""

    name_in_log = "vehicle.disarmed"


class GcsFound(BridgeEvent):
    """A ground station was heard for the first time."""

    name_in_log = "gcs.found"
    station: str


class GcsSilent(BridgeEvent):
    """A ground station was forgotten after a silence."""

    name_in_log = "gcs.silent"
    peer: str


class GcsRefused(BridgeEvent):
    """A ground station's frame was refused. Reported once for each reason."""

    name_in_log = "gcs.refused"
    level: Level = "warning"
    station: str
    message: str
    why: str


class GcsText(BridgeEvent):
    """A text for ground stations."""

    name_in_log = "gcs.text"
    level: Level = "debug"
    text: str


class ShareRefused(BridgeEvent):
    """A program's request was refused, or not answered in time. At debug level within 30 s of the one before."""

    name_in_log = "share.refused"
    level: Level = "warning"
    program: str
    command: str
    why: str


class UploadStarted(BridgeEvent):
    """A ground station's first item is requested."""

    name_in_log = "mission.upload_started"
    station: str
    count: int


class UploadEnded(BridgeEvent):
    """The final ack of a complete list is sent. `mission` is the number in the store."""

    name_in_log = "mission.upload_ended"
    station: str
    mission: int | None
    ack: str
    detail: str


class UploadRefused(BridgeEvent):
    """An upload was refused or abandoned."""

    name_in_log = "mission.refused"
    level: Level = "warning"
    station: str
    ack: str
    why: str


class PushStarted(BridgeEvent):
    """A list from the command line, the page or zenoh is to be written."""

    name_in_log = "mission.push_started"
    source: str
    count: int


class PushEnded(BridgeEvent):
    """The end of such a push, with or without success. `mission` is the list's number in the store."""

    name_in_log = "mission.push_ended"
    source: str
    mission: int | None
    ack: str
    detail: str


class MissionChangedOnBoard(BridgeEvent):
    """The flight controller's list changed, but not through the bridge."""

    name_in_log = "mission.changed_on_board"
    detail: str


class SettingsRead(BridgeEvent):
    """All settings were read for the first time."""

    name_in_log = "settings.read"
    settings: int


class SettingChanged(BridgeEvent):
    """A setting was changed in the flight controller's RAM. `by`: the client."""

    name_in_log = "settings.changed"
    setting: str
    before: str
    after: str
    by: str


class SettingsSaved(BridgeEvent):
    """The settings were written to the flight controller's flash. `changed`: those that the bridge had changed."""

    name_in_log = "settings.saved"
    changed: str


class SettingsChangedOnBoard(BridgeEvent):
    """Settings changed, but not through the bridge."""

    name_in_log = "settings.changed_on_board"
    level: Level = "warning"
    detail: str
    seal: str

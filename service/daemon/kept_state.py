# SPDX-License-Identifier: GPL-3.0-or-later
"""State that survives a restart of the daemon: a flight, which then goes on, and the last settings of boards."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from math import inf, isfinite
from pathlib import Path
from typing import Any

from bridge.model.craft import Airframe, FlightMemory, FlightMode, Home
from bridge.model.settings import BoardId, Value
from protocols.float32 import single
from service.machine.host import Host
from service.machine.state_file import StateFile

FLIGHT_FILE = "flight.json"
#: Changes with each start of the computer, and with it the clock of the times.
_BOOT_ID = "/proc/sys/kernel/random/boot_id"
#: After a longer stop the craft may have been armed again elsewhere. systemd restarts a crashed daemon in seconds.
_LONGEST_STOP_S = 60.0
SETTINGS_FILE = "last-settings.json"
#: Boards. The one read least recently is forgotten first. An INAV's settings are 25 kB.
_MOST = 16


class FlightFile:
    """Written on arming and disarming, and in flight when the mode changes. `port`: the flight controller's.

    It counts only on the same port, since the same start of the computer, and 60 s after a stop. Without a `folder`
    it forgets.
    """

    def __init__(self, folder: Path | None, port: str, host: Host) -> None:
        self._file = None if folder is None else StateFile(folder, FLIGHT_FILE, "a flight begins again")
        self._key = {"port": port, "boot_id": host.read(_BOOT_ID).strip()}
        self._saved: FlightMemory | None = None

    def load(self, now: float) -> FlightMemory | None:
        """The craft that the previous daemon left armed, if it counts. `now`: monotonic seconds."""
        if self._file is not None:
            self._saved = self._file.load(lambda kept: self._read(kept, now))
            if self._saved is not None:
                # The next stop may be a crash, without time to write.
                self._save(None)
        return self._saved

    def save(self, flight: FlightMemory | None) -> None:
        self._saved = flight
        self._save(None)

    def close(self, now: float) -> None:
        """Note the time of the stop, and finish writing."""
        if self._file is not None:
            if self._saved is not None:
                self._save(now)
            self._file.close()

    def _save(self, stopped_at: float | None) -> None:
        if self._file is not None:
            flight = self._saved
            plain = None if flight is None else asdict(flight) | {"mode": flight.mode and flight.mode.name}
            self._file.save({**self._key, "stopped_at": stopped_at, "flight": plain})

    def _read(self, kept: Any, now: float) -> FlightMemory | None:
        flight, stopped_at = kept["flight"], kept["stopped_at"]
        is_ours = all(self._key[name] and kept[name] == self._key[name] for name in self._key)
        is_recent = stopped_at is None or 0 <= now - stopped_at <= _LONGEST_STOP_S
        if flight is None or not is_ours or not is_recent:
            return None
        version = flight["version"]
        return FlightMemory(
            family=str(flight["family"]),
            armed_at=_number(flight["armed_at"], inf),
            made_at=_number(flight["made_at"], inf),
            mode=None if flight["mode"] is None else FlightMode[flight["mode"]],
            home=_home(flight["home"]),
            boxes=tuple(map(str, flight["boxes"])),
            activation=tuple(map(int, flight["activation"])),
            airframe=Airframe(flight["airframe"]),
            version=None if version is None else (int(version[0]), int(version[1]), int(version[2])),
            cells=int(flight["cells"]),
        )


def _home(kept: Any) -> Home | None:
    if kept is None:
        return None
    altitude_m = None if kept["altitude_m"] is None else _number(kept["altitude_m"], 1e5)
    return Home(int(_number(kept["lat_e7"], 90e7)), int(_number(kept["lon_e7"], 180e7)), altitude_m)


def _number(value: Any, most: float) -> float:
    number = float(value)
    if not isfinite(number) or abs(number) > most:
        raise ValueError(f"{number} is out of range")
    return number


class LastSettings:
    """A SettingsMemory. A board without a unique number is identified by the port.

    Without a `folder` it does not store anything.
    """

    def __init__(self, folder: Path | None, port: Callable[[], str]) -> None:
        self._port = port
        self._file = StateFile(folder, SETTINGS_FILE, "earlier changes of settings may be missed")
        self._boards: dict[str, Mapping[str, Value]] = self._file.load(_settings) or {}
        self.close = self._file.close

    def get(self, board: BoardId, default: Mapping[str, Value], /) -> Mapping[str, Value]:
        return self._boards.get(self._key(board), default)

    def __setitem__(self, board: BoardId, values: Mapping[str, Value], /) -> None:
        key = self._key(board)
        is_known = self._boards.pop(key, None) == values
        self._boards[key] = values
        if is_known:
            return
        while len(self._boards) > _MOST:
            del self._boards[next(iter(self._boards))]
        self._file.save(self._boards)

    def _key(self, board: BoardId) -> str:
        return f"{board.kind}, {board.uid or self._port()}"


def _settings(kept: Any) -> dict[str, Mapping[str, Value]]:
    return {
        str(board): {
            str(name): value for name, value in values.items() if isinstance(value, str) or isfinite(single(value))
        }
        for board, values in kept.items()
    }

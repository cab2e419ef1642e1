# SPDX-License-Identifier: GPL-3.0-or-later
"""The requests about the flight controller's settings, as part of DaemonApi."""

import asyncio
from collections.abc import Callable
from dataclasses import asdict
from difflib import get_close_matches
from functools import partial
from typing import TypeVar

from bridge.fc.fc_settings import SettingRefusal
from bridge.model.settings import BoardSetting, shown
from bridge.settings.local_settings import by_setting
from payloads.mission_data import MOST, Json, plain, whole_number
from payloads.settings_comparison import SettingValues, setting_values, settings_difference
from service.daemon.client import ControlError
from service.daemon.daemon import Daemon
from storage.mission_store import MissionStore
from storage.settings_backups import SettingsBackup

#: The values of "do".
SETTINGS_REQUESTS = frozenset(
    ("settings", "setting", "set-setting", "save-settings", "plan-settings", "restore-settings", "backups", "backup")
)
_MOST_LISTED = 300
_LONGEST_NAME = 64
#: A mode without a range.
_NO_TEXT = "none"
T = TypeVar("T")
Progress = Callable[[Json], None]


class SettingsApi:
    """The requests, as coroutines with plain data. ControlError or StoreError if one fails."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon

    async def do(self, request: Json, progress: Progress) -> Json:
        match request["do"]:
            case "settings":
                return await self.table()
            case "setting":
                return _data(await self._setting(request))
            case "set-setting":
                return await self._change(request)
            case "save-settings":
                return await self.save()
            case "plan-settings":
                return await self.plan(*_wanted(request))
            case "restore-settings":
                return await self.restore(*_wanted(request), "command line", progress)
            case "backups":
                return await self.backups(whole_number(request, "limit", 1, MOST))
        return await self.backup(whole_number(request, "number", 0, MOST))

    async def table(self) -> Json:
        """All settings. is_checked False if the flight controller could not be asked, they are as last read."""
        table = await self._answer(self._daemon.bridge.settings.read)
        return {
            "board": self._daemon.bridge.settings.kind or "",
            "is_complete": table.is_complete,
            "is_checked": self._daemon.bridge.settings.is_checked,
            "settings": [_data(setting) for setting in table],
        }

    async def save(self) -> Json:
        await self._answer(self._daemon.bridge.settings.save)
        return {"text": "Settings saved"}

    async def plan(self, values: SettingValues, board: str, *, is_checked: bool = True) -> Json:
        """The values that a restore would write, and those it cannot. board: the source of the values; "": unknown.

        is_checked False: compare with the table as last read, without using the flight controller's line.
        """
        plan = partial(self._daemon.bridge.settings.plan, values, board, is_checked=is_checked)
        return plain(await self._answer(plan))

    async def restore(self, values: SettingValues, board: str, client: str, progress: Progress) -> Json:
        """Set, save and verify. `progress` is called with the number of settings set so far."""

        def set_so_far(count: int) -> None:
            progress({"progress": count})

        restore = partial(self._daemon.bridge.settings.restore, values, board, client, set_so_far)
        return plain(await self._answer(restore))

    async def backups(self, limit: int) -> Json:
        lines = await self._daemon.store.ask(lambda store: store.backups.list(min(limit, _MOST_LISTED)))
        return {"backups": [asdict(line) for line in lines]}

    async def newest_backup(self) -> int | None:
        return await self._daemon.store.ask(lambda store: store.backups.newest())

    async def backup(self, number: int) -> Json:
        """One backup, with its difference from the same board's one before."""
        return await self._daemon.store.ask(lambda store: _backup(store, number))

    async def _setting(self, request: Json) -> BoardSetting:
        name = str(request.get("name"))[:_LONGEST_NAME]
        table = await self._answer(self._daemon.bridge.settings.read)
        setting = table.find(name) or table.find(*by_setting({name: name}, table.settings))
        if setting is None:
            # Not on the event loop: INAV has 800 names.
            near = await asyncio.to_thread(get_close_matches, name.lower(), [*table.settings], n=1)
            hint = f"did you mean {near[0]}?" if near else "see `naze-bridge settings list`"
            raise ControlError(f"this flight controller has no setting {name}: {hint}")
        return setting

    async def _change(self, request: Json) -> Json:
        setting = await self._setting(request)
        given = str(request.get("value"))
        if (value := setting.parse(given)) is None:
            raise ControlError(f"{setting.name} cannot be {given[:_LONGEST_NAME]}: {setting.wanted_text}")
        change = partial(self._daemon.bridge.settings.change, setting.name, value, client="command line")
        (after,) = await self._answer(change)
        if after.value == setting.value:
            text = f"{setting.name} is {_shown(after)} already"
        else:
            was, now = _shown(setting) or _NO_TEXT, _shown(after) or _NO_TEXT
            text = f"{setting.name} changed from {was} to {now}; not saved yet"
        return _data(after) | {"was": setting.value, "text": text}

    async def _answer(self, start: Callable[[Callable[[T | SettingRefusal, float], None], float], None]) -> T:
        """Wait for an operation's result. Raises ControlError if it is refused."""

        def begin(done: Callable[[T | SettingRefusal], None], now: float) -> None:
            start(lambda result, _at: done(result), now)

        result = await self._daemon.answer(begin)
        if isinstance(result, SettingRefusal):
            raise ControlError(result.text)
        return result


def _backup(store: MissionStore, number: int) -> Json:
    """Answer the request "backup". Raises ControlError if there is none of that number."""
    backup = store.backups.get(number)
    if backup is None:
        raise ControlError(f"there is no backup {number}; `naze-bridge settings history` shows the numbers")
    before = store.backups.before(backup.line)
    former: SettingsBackup | None = None if before is None else store.backups.get(before)
    changes = [] if former is None else settings_difference(former.values, backup.values)
    return asdict(backup.line) | {
        "before": before,
        "changes": [asdict(row) for row in changes],
        "values": dict(backup.values),
    }


def _wanted(request: Json) -> tuple[SettingValues, str]:
    return setting_values(request.get("values")), str(request.get("board") or "")


def _data(setting: BoardSetting) -> Json:
    return {
        "name": setting.name,
        "value": setting.value,
        "shown": _shown(setting),
        "minimum": setting.minimum,
        "maximum": setting.maximum,
        "range": setting.range_text,
        "unit": setting.unit,
        "choices": list(setting.choices),
        "fixed": setting.fixed,
    }


def _shown(setting: BoardSetting) -> str:
    if setting.choices and not isinstance(setting.value, str):
        place = int(setting.value - setting.minimum)
        if 0 <= place < len(setting.choices):
            return setting.choices[place]
    return shown(setting.value)

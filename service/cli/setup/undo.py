# SPDX-License-Identifier: GPL-3.0-or-later
"""The changes of each setup, so that `naze-bridge setup --undo` can revert the last one."""

import json
from collections.abc import Iterator
from typing import TypedDict

from service.cli.setup.change import Change, Machine, RemoveFile, Run, SetupError, Step, WriteFile
from service.machine.host import Host
from service.machine.raspberry_pi import BOOT_FOLDERS

UNDO_FILE = "/etc/naze-bridge/undo.json"
#: Older setups cannot be undone.
_MOST_KEPT = 10


class _File(TypedDict):
    """`before` and `after` None: the file did not exist."""

    path: str
    before: str | None
    after: str | None
    secret: bool


class _Setup(TypedDict):
    files: list[_File]
    commands: list[list[str]]


class UndoLog:
    """The changes of this setup, saved after each one, following those of earlier setups."""

    def __init__(self, host: Host, machine: Machine) -> None:
        self._host = host
        self._machine = machine
        self._earlier = _read(host)
        self._now: _Setup = {"files": [], "commands": []}

    def carry_out(self, change: Change) -> None:
        if isinstance(change, Run):
            self._machine.carry_out(change)
            if change.undo and list(change.undo) not in self._now["commands"]:
                self._now["commands"].append(list(change.undo))
        else:
            path = self._host.path(change.path)
            before = self._host.read(change.path) if path.exists() else None
            is_secret = path.exists() and path.stat().st_mode & 0o077 == 0
            self._machine.carry_out(change)
            self._now["files"].append({"path": change.path, "before": before, "after": None, "secret": is_secret})
        for file in self._now["files"]:
            file["after"] = _text(self._host, file["path"])  # raspi-config also changes cmdline.txt
        if self._now["files"] or self._now["commands"]:
            _write(self._machine, [*self._earlier, self._now])


def undo_steps(host: Host) -> tuple[list[Step], list[str]]:
    """The steps that revert the last setup, and the files that are kept because they have changed since."""
    if not (kept := _read(host)):
        return [], []
    files = list(reversed(kept[-1]["files"]))
    changed = [file["path"] for file in files if not _is_same(_text(host, file["path"]), file["after"])]
    changes = [_restore(file) for file in files if file["path"] not in changed]
    changes += [Run(tuple(command)) for command in kept[-1]["commands"]]
    if not changes:
        return [], changed
    needs_reboot = any(file["path"].startswith(BOOT_FOLDERS) for file in files)
    return [Step("undo the last setup", changes, needs_reboot=needs_reboot)], changed


def forget_last(host: Host, machine: Machine) -> None:
    if left := _read(host)[:-1]:
        _write(machine, left)
    else:
        machine.carry_out(RemoveFile(UNDO_FILE))


def _restore(file: _File) -> Change:
    before = file["before"]
    return RemoveFile(file["path"]) if before is None else WriteFile(file["path"], before, file["secret"])


def _is_same(now: str | None, after: str | None) -> bool:
    """True if a file was not changed since; an opened hotspot turns its autoconnect on."""
    off, on = "autoconnect=false", "autoconnect=true"
    return now == after or (now is not None and after is not None and now == after.replace(off, on))


def _text(host: Host, path: str) -> str | None:
    return host.read(path) if host.path(path).exists() else None


def _read(host: Host) -> list[_Setup]:
    text = host.read(UNDO_FILE)
    try:
        kept: list[_Setup] = json.loads(text) if text else []
        list(_commands(kept))
    except (ValueError, TypeError, KeyError) as error:
        raise SetupError(f"{UNDO_FILE} is damaged: remove it to continue without undo") from error
    return kept


def _commands(kept: list[_Setup]) -> Iterator[str]:
    """Every word and path in the record; a damaged one raises."""
    for setup in kept:
        yield from (word for command in setup["commands"] for word in command)
        yield from (file["path"] for file in setup["files"])


def _write(machine: Machine, kept: list[_Setup]) -> None:
    # Secret: it may hold a previous key.
    machine.carry_out(WriteFile(UNDO_FILE, json.dumps(kept[-_MOST_KEPT:], indent=1) + "\n", secret=True))

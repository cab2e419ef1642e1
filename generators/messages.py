# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m generators.messages`: print a new messages.py, the part of pymavlink's ardupilotmega that we use.

The whole dialect costs a process 6 MB and a tenth of a second. A message is part of it if its class or id is named in
an installed package, and a constant if it is named there.
"""

import ast
import inspect
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

_PROJECT = Path(__file__).resolve().parent.parent
_MODULE, _NAME = "protocols.mavlink.dialect", "messages"
_ID, _CLASS = "MAVLINK_MSG_ID_", "MAVLink_{}_message"
#: Names that messages.py has besides pymavlink's.
_OURS = {"COMMAND_NAMES", "KINDS"}
_HEAD = '''# SPDX-License-Identifier: GPL-3.0-or-later
"""The messages and constants that we use, by pymavlink's names. Made by `make messages` from pymavlink, not by hand.

Each message is of the dialect ardupilotmega; a field of type char is bytes if set, and text if read.
"""

from collections.abc import Mapping, Sequence
from struct import Struct

from protocols.mavlink.message_base import MavlinkMessage, as_text

'''


def module() -> str:
    """The text of messages.py. AttributeError if pymavlink lacks a name."""
    names = used_names()
    dialect = sorted(ardupilotmega.mavlink_map.items())
    kinds = [kind for _, kind in dialect if {_class(kind), _ID + kind.msgname} & names]
    constants = sorted(names - {_class(kind) for kind in kinds} - _OURS)
    commands = sorted(ardupilotmega.enums["MAV_CMD"].items())[:-1]  # the last one is MAV_CMD_ENUM_END
    parts = [
        *(f"{name} = {getattr(ardupilotmega, name)}\n" for name in constants),
        "\n#: By MAV_CMD.\nCOMMAND_NAMES: Mapping[int, str] = {\n",
        *(f'    {number}: "{entry.name.removeprefix("MAV_CMD_")}",\n' for number, entry in commands),
        "}\n",
        *map(_definition, kinds),
        "\n\n#: By message id.\nKINDS: Mapping[int, type[MavlinkMessage]] = {\n",
        *(f"    {kind.id}: {_class(kind)},\n" for kind in kinds),
        "}\n",
    ]
    return _HEAD + "".join(parts)


def used_names() -> set[str]:
    """The attributes of `messages` that the installed packages name."""
    packages = tomllib.loads((_PROJECT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    files = (file for package in packages["packages"] for file in (_PROJECT / package).rglob("*.py"))
    return {name for file in files for name in _used_in(ast.parse(file.read_text()))}


def _used_in(tree: ast.Module) -> Iterator[str]:
    nodes = list(ast.walk(tree))
    imports = (node for node in nodes if isinstance(node, ast.ImportFrom) and node.module == _MODULE)
    aliases = {each.asname or each.name for node in imports for each in node.names if each.name == _NAME}
    for node in nodes:
        match node:
            case ast.Attribute(value=ast.Name(id=owner), attr=name) if owner in aliases:
                yield name


def _class(kind: Any) -> str:
    return _CLASS.format(kind.msgname.lower())


def _definition(kind: Any) -> str:
    """The class of one message."""
    counts = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    texts = {name for name, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True) if type_name == "char"}
    slots, places, stored, sent = [], {}, [], []
    at = 0
    for name in kind.ordered_fieldnames:
        end = at + (1 if name in texts else max(1, counts[name]))
        is_array = counts[name] and name not in texts
        places[name] = f"slice({at}, {end})" if is_array else str(at)
        at = end
        sent.append(f"self._{name}" if name in texts else f"*self.{name}" if is_array else f"self.{name}")
    for name in kind.fieldnames:
        slots.append(f'"{name}"')
        stored.append(f"        self.{name} = {f'as_text({name})' if name in texts else name}\n")
        if name in texts:
            slots.append(f'"_{name}"')
            stored.append(f"        self._{name} = {name}\n")
    return f'''

class {_class(kind)}(MavlinkMessage):
    __slots__ = {_tuple(slots)}
    msgid = {kind.id}
    msgname = "{kind.msgname}"
    unpacker = Struct("{kind.unpacker.format}")
    places = {_tuple([places[name] for name in kind.fieldnames])}

    def __init__{inspect.signature(kind.__init__)} -> None:
{"".join(stored)}
    def to_payload(self) -> bytes:
        return self.unpacker.pack({", ".join(sent)})
'''


def _tuple(parts: Sequence[str]) -> str:
    return f"({', '.join(parts)}{',' * (len(parts) == 1)})"


if __name__ == "__main__":
    sys.stdout.write(module())

# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of all settings, made from the dataclasses: for the reader and the docs."""

from collections.abc import Iterator
from dataclasses import Field, fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from service.settings.key import Default, Example, Key, Reader, choice, file_name, text, whole, yes_no
from service.settings.settings import Settings


def _notes(kind: type) -> Iterator[tuple[Field[Any], Any, tuple[Any, ...]]]:
    """Each annotated field, with the type (without None) and its notes. Those of the bridge come last."""
    hints = get_type_hints(kind, include_extras=True)
    for field in sorted(fields(kind), key=lambda each: bool(each.kw_only)):
        if get_origin(hint := hints[field.name]) is Annotated:
            kind_of, *notes = get_args(hint)
            yield field, get_args(kind_of)[0] if isinstance(kind_of, UnionType) else kind_of, tuple(notes)


def _is_table(field: Field[Any], kind: Any) -> bool:
    return is_dataclass(kind) and field.default is None


def _table_of(kind: type, prefix: str = "") -> Iterator[Key]:
    default = kind()
    for field, its_type, notes in _notes(kind):
        if _is_table(field, its_type):
            continue
        found: dict[type, Any] = {type(note): note for note in notes}
        example, shown = found.get(Example, ""), found.get(Default, "")
        if not example and not shown:
            shown = _as_in_a_file(getattr(default, field.name))
        reader = found.get(Reader) or _reader_of(its_type, found.get(range))
        yield Key(prefix + field.name, reader, found[str], shown, example)


def _reader_of(kind: Any, numbers: range | None) -> Reader:
    if numbers is not None:
        return whole(numbers[0], numbers[-1])
    if kind is bool:
        return yes_no()
    if kind is Path:
        return file_name()
    return choice(kind) if issubclass(kind, Enum) else text()


def _as_in_a_file(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    return "[]" if value == () else f'"{value.value if isinstance(value, Enum) else value}"'


_TABLES = [(field.name, kind, notes[0]) for field, kind, notes in _notes(Settings) if _is_table(field, kind)]
#: Tables whose presence enables a part, with their meaning.
TABLES: dict[str, str] = {name: meaning for name, _, meaning in _TABLES}
KEYS = (*_table_of(Settings), *(key for name, kind, _ in _TABLES for key in _table_of(kind, f"{name}.")))

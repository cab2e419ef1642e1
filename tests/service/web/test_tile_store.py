# SPDX-License-Identifier: GPL-3.0-or-later

from pathlib import Path

import pytest

from service.web.tile_store import CacheFullError, TileCache, image_type


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file()}


def test_a_tile_is_fresh_until_it_expires(tmp_path: Path) -> None:
    cache, file = TileCache(tmp_path, 100, set()), tmp_path / "3" / "1"
    assert not cache.is_fresh(file, 10)
    cache.keep(file, b"tile", 20)
    assert (cache.is_fresh(file, 10), cache.is_fresh(file, 30)) == (True, False)
    assert file.read_bytes() == b"tile"


def test_files_are_counted_across_restarts_and_when_they_are_replaced(tmp_path: Path) -> None:
    TileCache(tmp_path, 100, set()).keep(tmp_path / "a", b"1234", 1)
    cache = TileCache(tmp_path, 100, set())
    cache.keep(tmp_path / "a", b"12", 1)
    cache.keep(tmp_path / "b", b"1", 1)
    assert (cache.tiles, cache.bytes) == (2, 3)


def test_those_that_expire_first_make_room_but_none_that_is_wanted(tmp_path: Path) -> None:
    cache = TileCache(tmp_path, 10, set())
    for name, expires in (("late", 30), ("first", 10), ("second", 20)):
        cache.keep(tmp_path / name, b"123", expires)
    cache = TileCache(tmp_path, 10, {tmp_path / "second", tmp_path / "new"})
    cache.keep(tmp_path / "new", b"1234", 40)
    assert names(tmp_path) == {"late", "second", "new"}
    cache.keep(tmp_path / "newer", b"123", 40)
    assert names(tmp_path) == {"second", "new", "newer"}
    with pytest.raises(CacheFullError, match="are full"):
        cache.keep(tmp_path / "newest", b"123", 40)
    assert (cache.tiles, cache.bytes) == (3, 10)


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"\x89PNG\r\n\x1a\n....", "image/png"),
        (b"\xff\xd8\xff\xe0", "image/jpeg"),
        (b"RIFF....WEBPVP8 ", "image/webp"),
        (b"RIFF....WAVE", None),
        (b"<svg onload='alert(1)'>", None),
        (b"<!doctype html>", None),
        (b"", None),
    ],
)
def test_an_image_is_known_by_its_first_bytes(data: bytes, kind: str | None) -> None:
    assert image_type(data) == kind

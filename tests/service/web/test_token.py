# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's token: made once, kept secret."""

from pathlib import Path

import pytest

from service.web.token import Token, TokenError


def test_a_token_is_created_once(tmp_path: Path) -> None:
    path = tmp_path / "token"
    token = Token(path)
    text = path.read_text().strip()
    assert path.stat().st_mode & 0o777 == 0o600
    assert token.is_shown_by(f"Bearer {text}")
    assert Token(path).is_shown_by(f"bearer {text} ")
    assert Token(tmp_path / "other").path.read_text() != f"{text}\n"


@pytest.mark.parametrize(
    "shown", [None, "", "Bearer", "Bearer ", "Bearer x", "Basic {}", "{}", "Bearer {}x", "Bearer \udcff"]
)
def test_a_wrong_token_is_refused(tmp_path: Path, shown: str | None) -> None:
    token = Token(tmp_path / "token")
    text = token.path.read_text().strip()
    assert not token.is_shown_by(None if shown is None else shown.format(text))


def test_an_invalid_token_file_is_reported_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "open").write_text("a token readable by all")
    (tmp_path / "open").chmod(0o644)
    (tmp_path / "empty").touch(0o600)
    (tmp_path / "long").touch(0o600)
    (tmp_path / "long").write_bytes(bytes(5000))
    for path, reason in {
        tmp_path / "open": f"other users can read the token in {tmp_path}/open: chmod 600 {tmp_path}/open",
        tmp_path / "empty": "is shorter than 12 characters",
        tmp_path / "long": "cannot be read: it is larger than 4 kB",
        tmp_path: "is not a file",
        tmp_path / "nowhere" / "token": "a token cannot be written to",
        tmp_path / "open" / "token": "cannot be read: Not a directory",
    }.items():
        with pytest.raises(TokenError, match=reason):
            Token(path)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[web]` table and the token file: accepted values, and messages about others."""

from pathlib import Path

import pytest

from service.settings import SettingsError, load_settings
from service.settings.web import ListenAddress, WebSettings
from service.web.token import Token, TokenError


def load(tmp_path: Path, text: str) -> WebSettings | None:
    config = tmp_path / "naze.toml"
    config.write_text(text)
    return load_settings(config, "sim:", (), tmp_path).web


def test_the_table_has_defaults_and_is_read(tmp_path: Path) -> None:
    assert load(tmp_path, "") is None
    assert load(tmp_path, "[web]\n") == WebSettings(ListenAddress("127.0.0.1", 8080), (), None)
    given = load(tmp_path, '[web]\nlisten = "[::]:80"\nhosts = ["Naze.example"]\ntoken_file = "mine"\n')
    assert given == WebSettings(ListenAddress("::", 80), ("naze.example",), tmp_path / "mine")
    assert str(given.listen) == "[::]:80"


def test_the_environment_variable_is_enough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NAZE_BRIDGE_WEB_LISTEN", "0.0.0.0:8080")
    assert load(tmp_path, "") == WebSettings(ListenAddress("0.0.0.0", 8080))  # noqa: S104 - only read


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("web = true", ["web", "a table"]),
        ("[web]\nlisen = 'x'", ["web.lisen", "web.listen"]),
        ("[web]\nlisten = 8080", ["web.listen is 8080", '"HOST:PORT"']),
        ("[web]\nlisten = '8080'", ["'8080' needs a host and a port", "0.0.0.0:8080"]),
        ("[web]\nlisten = ':::80'", ["brackets"]),
        ("[web]\nlisten = '0.0.0.0:99999'", ["99999", "not a port number"]),
        ("[web]\nhosts = ['naze.example:8080']", ["web.hosts holds 'naze.example:8080'", "not a host name"]),
        ("[web]\ntoken_file = ''", ["web.token_file is ''", "text in quotes"]),
        (
            "gcs = ['tcpin:127.0.0.1:8080']\n[web]",
            ["gcs tcpin:127.0.0.1:8080 and web.listen 127.0.0.1:8080", "TCP port 8080"],
        ),
    ],
)
def test_an_invalid_table_is_one_sentence(tmp_path: Path, text: str, reason: list[str]) -> None:
    with pytest.raises(SettingsError) as caught:
        load(tmp_path, text)
    (problem,) = map(str, caught.value.problems)
    assert problem.startswith(str(tmp_path / "naze.toml"))
    for part in reason:
        assert part in problem


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


def test_an_invalid_token_file_is_one_sentence(tmp_path: Path) -> None:
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

# SPDX-License-Identifier: GPL-3.0-or-later
"""The `[web]` table and the token file: accepted values, and messages about others."""

from pathlib import Path

import pytest

from service.settings import SettingsError, load_settings
from service.settings.web import ListenAddress, WebSettings


def load(tmp_path: Path, text: str) -> WebSettings | None:
    config = tmp_path / "naze.toml"
    config.write_text(text)
    return load_settings(config, fc="sim:", state_dir=tmp_path).web


def test_the_table_has_defaults_and_is_read(tmp_path: Path) -> None:
    assert load(tmp_path, "") is None
    assert load(tmp_path, "[web]\n") == WebSettings(ListenAddress("127.0.0.1", 8080), (), None)
    given = load(tmp_path, '[web]\nlisten = "[::]:80"\nhosts = ["Naze.example"]\ntoken_file = "mine"\n')
    assert given == WebSettings(ListenAddress("::", 80), ("naze.example",), tmp_path / "mine")
    assert str(given.listen) == "[::]:80"


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
    ],
)
def test_an_invalid_table_is_reported_in_one_sentence(tmp_path: Path, text: str, reason: list[str]) -> None:
    with pytest.raises(SettingsError) as caught:
        load(tmp_path, text)
    (problem,) = map(str, caught.value.problems)
    assert problem.startswith(str(tmp_path / "naze.toml"))
    for part in reason:
        assert part in problem

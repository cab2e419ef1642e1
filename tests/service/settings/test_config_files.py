# SPDX-License-Identifier: GPL-3.0-or-later
"""The line of each key is found in one pass over any file."""

import tomllib

from hypothesis import given
from hypothesis import strategies as st

from generators.config_sample import sample
from service.settings.config_files import key_lines

TEXT = '''# settings
sysid = 3
gcs = [   # several
  "udpin:0.0.0.0:1",
  { address = "a[]" },
]
note = """
sysid = [
"""
[zenoh]

connect = ["]", [1,
  2]]
listen = ']'
[web.more]
web = 1
'''


def test_values_of_several_lines_and_tables_have_lines() -> None:
    lines = key_lines(TEXT)
    wanted = {("sysid",): 2, ("gcs",): 3, ("note",): 7, ("zenoh",): 10, ("zenoh", "connect"): 12}
    wanted |= {("zenoh", "listen"): 14, ("web",): 15, ("web", "more"): 15}
    assert {key: lines[key] for key in wanted} == wanted


def test_other_ways_to_write_a_table() -> None:
    lines = key_lines('zenoh.prefix = "x"\nzenoh.vehicle = "y"\nweb = {listen = "a",\ttoken_file = "b"}\r\nsysid = 1')
    assert lines == {
        ("zenoh",): 1,
        ("zenoh", "prefix"): 1,
        ("zenoh", "vehicle"): 2,
        ("web",): 3,
        ("web", "listen"): 3,
        ("web", "token_file"): 3,
        ("sysid",): 4,
    }


def test_an_unbalanced_list_affects_only_the_lines_after_it() -> None:
    text = "sysid = 1\ngcs = [" + "[],\n" * 20_000 + "]\nfc = 'sim:'\n"
    assert tomllib.loads(text)
    assert key_lines(text) == {("sysid",): 1}


PIECES = st.sampled_from(
    ["a = 1", "[b]", "c = [", '"x",', "]", 'd = """', '"""', "# ]", "", "e.f = 2", "[[g]]", "h = {i = [", "]}", "[b.j]"]
)


@given(st.lists(PIECES, max_size=12).map("\n".join))
def test_every_key_of_a_valid_file_has_a_line_that_names_it(text: str) -> None:
    try:
        held = tomllib.loads(text)
    except ValueError:
        key_lines(text)
        return
    lines = key_lines(text)
    for key in held:
        assert key in text.split("\n")[lines[key,] - 1]


def test_each_line_of_the_sample_is_found() -> None:
    lines = [line.removeprefix("#") if not line.startswith("# ") else line for line in sample().splitlines()]
    for (*_, key), number in key_lines("\n".join(lines)).items():
        assert key in lines[number - 1]

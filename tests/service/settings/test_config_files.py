# SPDX-License-Identifier: GPL-3.0-or-later
"""The line of each key is found in one pass over any file."""

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


def test_keys_with_dots_name_their_table() -> None:
    lines = key_lines('zenoh.prefix = "x"\nzenoh.vehicle = "y"\r\nsysid = 1')
    assert lines == {("zenoh",): 1, ("zenoh", "prefix"): 1, ("zenoh", "vehicle"): 2, ("sysid",): 3}


def test_each_line_of_the_sample_is_found() -> None:
    lines = [line.removeprefix("#") if not line.startswith("# ") else line for line in sample().splitlines()]
    for (*_, key), number in key_lines("\n".join(lines)).items():
        assert key in lines[number - 1]

# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample configuration file, examples/config.toml, from the table of keys (`make config-sample`)."""

import sys
import textwrap

from service.settings.table import KEYS, TABLES

_HEAD = (
    "All settings of naze-bridge. Commented-out lines show the default, or an example.",
    "Copy what you change to config.toml (the service's is /etc/naze-bridge/config.toml).",
    "It overrides setup.toml, the answers to `naze-bridge setup`.",
    "Flags of `naze-bridge run` override all files.",
    "`naze-bridge run --check-config --config FILE` checks the settings.",
    "A change needs a restart: `systemctl restart naze-bridge`, in flight, too.",
)
_WIDTH = 100


def sample() -> str:
    """The file, with every setting commented out."""
    lines = [_comment(line) for line in _HEAD]
    table = ""
    for key in KEYS:
        before, dot, name = key.name.rpartition(".")
        if dot and before != table:
            table = before
            lines += ["", _comment(TABLES[table]), f"#[{table}]"]
        value = key.default or key.example
        lines += ["", _comment(key.meaning), f"#{name} = {value}"]
    return "\n".join(lines) + "\n"


def _comment(text: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent="# ", subsequent_indent="# ")


if __name__ == "__main__":
    sys.stdout.write(sample())

# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample configuration file, and the table of the reference page: `python -m generators.config_sample [--page]`.

Both are made from the table of keys; a test compares them with the files in the repository (`make config-sample`).
"""

import sys
import textwrap

from service.settings.key import Key
from service.settings.table import KEYS, TABLES

_HEAD = (
    "All settings of naze-bridge. Commented-out lines show the default, or an example.",
    "Copy what you change to config.toml (the service's is /etc/naze-bridge/config.toml).",
    "It overrides setup.toml, the answers to `naze-bridge setup`; conf.d/*.toml override both.",
    "Environment variables (NAZE_BRIDGE_SYSID, NAZE_BRIDGE_ZENOH_PREFIX) and flags override all files.",
    "`naze-bridge run --check-config --config FILE` checks the settings.",
    '`systemctl reload naze-bridge` applies settings marked "live"; the others need a restart.',
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
        note = " (live)" if key.is_live else ""
        value = key.default or key.example
        lines += ["", _comment(key.meaning + note), f"#{name} = {value}"]
    return "\n".join(lines) + "\n"


def page() -> str:
    """The rows of the reference page."""
    rows = ["| key | default | meaning |", "|---|---|---|"]
    rows += [f"| `{key.name}` | {_default(key)} | {_cell(key)} |" for key in KEYS]
    return "\n".join(rows) + "\n"


def _default(key: Key) -> str:
    return f"`{key.default}`" if key.default else ""


def _cell(key: Key) -> str:
    example = "" if key.default or not key.example else f" Example: `{key.example}`."
    return key.meaning.replace("|", "\\|") + example + (" *Live.*" if key.is_live else "")


def _comment(text: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent="# ", subsequent_indent="# ")


if __name__ == "__main__":
    sys.stdout.write(page() if "--page" in sys.argv else sample())

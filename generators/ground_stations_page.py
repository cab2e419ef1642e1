# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts in docs/ground-stations.md, from the table of sentences (`make ground-stations-page`)."""

import re
import sys

from bridge.voice.happening import Sentence, Severity
from bridge.voice.sentences import table


def texts() -> str:
    """Every text with its severity, the worst first, in the order of the table."""
    rows = ["| severity | text |", "|---|---|"]
    sentences = table().values()
    for severity in Severity:
        rows += [f"| {severity.name} | {_shown(each)} |" for each in sentences if each.severity is severity]
    return "\n".join(dict.fromkeys(rows)) + "\n"


def _shown(sentence: Sentence[*tuple[object, ...]]) -> str:
    found = [sentence.text, *([sentence.short] if sentence.short != sentence.text else [])]
    shown = ", on a HUD ".join(re.sub(r"\{[^}]*\}", "...", text) for text in found)
    if sentence.planner:
        shown += f", on Mission Planner {sentence.planner}"
    return shown + (" (repeated)" if sentence.lasts else "")


if __name__ == "__main__":
    sys.stdout.write(texts())

# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts for the pilot about a written mission: the findings with equal ones merged, and a summary line."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from protocols.mission_item import Command
from reports.finding import DROPPED, Finding, News, without_defaults
from reports.verdict import Verdict

_MOST_LINES = 10
#: A longer text would be split, and Mission Planner's HUD shows only the last piece.
_LINE_LENGTH = 50


def summary(sent: int, verdict: Verdict[Any]) -> str | None:
    """A summary of `sent` items and the worst finding; None if nothing was lost or changed its meaning."""
    warnings = [finding for finding in verdict.findings if finding.news is News.WARNING]
    if not warnings:
        return None
    if not verdict.items:
        return warnings[-1].text()
    dropped = sum(finding.becomes == DROPPED for finding in verdict.findings)
    kept = [finding for finding in warnings if finding.becomes != DROPPED]
    relative = sum(finding.field == "frame" and finding.seq != 0 for finding in kept)
    heights = [finding for finding in kept if finding.field == "alt_m" and finding.becomes != finding.was]
    raised, landings = len(heights), sum(finding.command == Command.NAV_LAND for finding in heights)
    home = sum(finding.seq == 0 for finding in kept)
    differing = len(kept) - relative - raised - home
    counts = {
        "dropped": dropped,
        "Alt now relative": relative,
        "Alt raised": raised - landings,
        "LAND flown to first": landings,
        "flown differently": differing,
    }
    news = [f"{count} {what}" for what, count in counts.items() if count] or ["check home"]
    stored = f"{len(verdict.items)} of {sent} stored: "
    text = stored + ", ".join(news)
    while len(text) > _LINE_LENGTH:
        text = stored + ", ".join([*(news := news[:-1]), "more"])
    return text


def finding_lines(findings: Iterable[Finding]) -> list[tuple[News, str]]:
    """The lines before the summary: warnings first, at most ten."""
    first: dict[Finding, Finding] = {}
    counts: Counter[Finding] = Counter()
    for finding in without_defaults(findings):
        kind = replace(finding, seq=min(finding.seq or 0, 1))
        first.setdefault(kind, finding)
        counts[kind] += 1
    lines = [(finding.news, finding.text(counts[kind])) for kind, finding in first.items()]
    lines.sort(key=lambda line: line[0] is not News.WARNING)
    if len(lines) > _MOST_LINES:
        more = f"and {len(lines) - _MOST_LINES} more: see the status page or naze-bridge missions show"
        lines[_MOST_LINES:] = [(News.NOTICE, more)]
    return lines

# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts for the pilot about a written mission: the findings with equals merged, and a summary line."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from bridge.voice import sentences
from bridge.voice.happening import LINE_LENGTH, Happening
from protocols.mission_item import Command
from reports.finding import DROPPED, NOT_FLOWN, Finding, News, without_defaults
from reports.verdict import Verdict

_MOST_LINES = 10
#: The sentences of findings, the most important first. Before the summary only dangers are warnings.
_SENTENCES = {
    News.DANGER: sentences.DANGER,
    News.WARNING: sentences.CHANGED_ITEM,
    News.NOTICE: sentences.ROUNDED_ITEM,
}


def with_meant_home(verdict: Verdict[Any]) -> Verdict[Any]:
    """Without the warning that item 0 became home."""
    findings = [finding for finding in verdict.findings if (finding.seq, finding.field) != (0, "frame")]
    return replace(verdict, findings=tuple(findings))


def summary(sent: int, verdict: Verdict[Any], *, is_unchanged: bool = False) -> str:
    """What is stored of `sent` items, the worst findings, and the flight, in one line."""
    start = f"{len(verdict.items)} of {sent} {'unchanged' if is_unchanged else 'stored'}: "
    warnings = [finding for finding in verdict.findings if finding.is_warning]
    if not warnings:
        return _fitted(start, [], verdict.flight)
    if not verdict.items:
        return warnings[-1].text()
    dropped = sum(finding.becomes == DROPPED for finding in verdict.findings)
    kept = [finding for finding in warnings if finding.becomes != DROPPED and finding.news is not News.DANGER]
    relative = sum(finding.field == "frame" and finding.seq != 0 for finding in kept)
    heights = [finding for finding in kept if finding.field == "alt_m" and finding.becomes != finding.was]
    raised, landings = len(heights), sum(finding.command == Command.NAV_LAND for finding in heights)
    home = sum(finding.seq == 0 for finding in kept)
    counts = {
        "dropped": dropped,
        "Alt now relative": relative,
        "Alt raised": raised - landings,
        "LAND flown to first": landings,
        "flown differently": len(kept) - relative - raised - home,
    }
    dangers = [finding for finding in warnings if finding.news is News.DANGER]
    is_refused = any(finding.why.startswith(NOT_FLOWN) for finding in dangers)
    news = ["will not fly"] if is_refused else [f"{len(dangers)} danger{'s' * (len(dangers) > 1)}"] * bool(dangers)
    news += ["check home"] * (home > 0) + [f"{count} {what}" for what, count in counts.items() if count]
    return _fitted(start, news, verdict.flight)


def _fitted(start: str, news: list[str], flight: Sequence[str]) -> str:
    """As much of the flight as fits the line, then as much of the news."""
    if len(text := start + ", ".join((*news, *flight))) <= LINE_LENGTH:
        return text
    short = [fact.replace("returns home at", "RTL at").replace("does not land", "no landing") for fact in flight]
    least = [fact for fact in short if not fact.startswith("highest")]
    for facts in (short, least, least[:1], ()):
        if len(text := start + ", ".join((*news, *facts))) <= LINE_LENGTH:
            return text
    while len(text) > LINE_LENGTH:
        text = start + ", ".join([*(news := news[:-1]), "more"])
    return text


def finding_lines(findings: Iterable[Finding]) -> list[Happening]:
    """The lines before the summary: warnings first, at most ten."""
    first: dict[Finding, Finding] = {}
    counts: Counter[Finding] = Counter()
    for finding in without_defaults(findings):
        kind = replace(finding, seq=min(finding.seq or 0, 1))
        first.setdefault(kind, finding)
        counts[kind] += 1
    lines = [_SENTENCES[finding.news](finding.text(counts[kind])) for kind, finding in first.items()]
    lines.sort(key=lambda line: line.severity)
    if len(lines) > _MOST_LINES:
        lines[_MOST_LINES:] = [sentences.MORE_FINDINGS(len(lines) - _MOST_LINES)]
    return lines

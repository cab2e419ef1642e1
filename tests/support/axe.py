# SPDX-License-Identifier: GPL-3.0-or-later
"""axe-core's accessibility checks of a page."""

import importlib.util
from pathlib import Path

from tests.support.chromium import Browser


def axe_core() -> str:
    found = importlib.util.find_spec("axe_playwright_python")
    assert found is not None
    assert found.origin is not None
    return (Path(found.origin).parent / "axe.min.js").read_text()


def violations(page: Browser) -> list[str]:
    if not page.run("return 'axe' in window"):
        page.run(axe_core())
    # Also the rules that are off by default: enhanced contrast (it leaves out what color-contrast reports), the size of
    # targets, experimental ones.
    run = """
        const done = arguments[arguments.length - 1];
        const rules = Object.fromEntries(axe.getRules().map((rule) => [rule.ruleId, { enabled: true }]));
        axe.run({ rules, resultTypes: ['violations'] }).then((result) => done(result.violations.flatMap(
          (found) => found.nodes.map((node) => `${found.id}: ${node.html} ${node.failureSummary}`))));"""
    found: list[str] = page.driver.execute_async_script(run)
    return found

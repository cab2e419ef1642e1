# SPDX-License-Identifier: GPL-3.0-or-later
"""Every metric in the dashboards and alerts of examples/fleet exists in a daemon."""

import asyncio
import json
import re
from pathlib import Path

from prometheus_client.parser import text_string_to_metric_families

from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import parse_fc
from service.settings.zenoh import ZenohSettings
from service.web.metrics import Metrics
from tests.support.programs import until_async
from tests.support.zenoh_router import EXAMPLES

_NAME = re.compile(r"\b(?:naze_bridge|process)_[a-z_]+")
#: Metrics that exist only after an event, or only with a session.
_LATER = {"naze_bridge_missions_total", "naze_bridge_refused_frames_total", "naze_bridge_zenoh_dropped_total"}


def wanted() -> set[str]:
    dashboards = [json.loads(path.read_text()) for path in (EXAMPLES / "fleet" / "grafana" / "dashboards").iterdir()]
    expressions = [target["expr"] for each in dashboards for panel in each["panels"] for target in panel["targets"]]
    assert len(expressions) > 10
    alerts = (EXAMPLES / "fleet" / "alerts.yml").read_text()
    return set(_NAME.findall(" ".join([*expressions, alerts])))


async def test_every_metric_of_the_examples_exists(tmp_path: Path) -> None:
    daemon = Daemon(Settings(parse_fc("sim:"), [], tmp_path, zenoh=ZenohSettings(vehicle="kite")))
    metrics = Metrics(daemon)
    running = asyncio.create_task(daemon.run())

    def names() -> set[str]:
        families = list(text_string_to_metric_families(metrics.render().decode()))
        assert all(sample.labels["vehicle"] == "kite" for family in families for sample in family.samples)
        return {sample.name for family in families for sample in family.samples}

    await until_async(lambda: wanted() - _LATER <= names(), "all metrics of the dashboards")
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)

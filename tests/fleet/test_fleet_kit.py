# SPDX-License-Identifier: GPL-3.0-or-later
"""examples/fleet: every metric in the dashboards and alerts exists in a daemon, and the storages are as documented."""

import asyncio
import json
import re
from pathlib import Path

import pytest
import zenoh
from prometheus_client.parser import text_string_to_metric_families

from payloads.keys import EVENT, KEYS, MISSION_CURRENT, MISSION_REPORT, OVERVIEW, STATE, ZenohKey, full
from service.daemon.daemon import Daemon
from service.settings import Settings
from service.settings.addresses import parse_fc
from service.settings.zenoh import ZenohSettings
from service.web.metrics import Metrics
from tests.support.programs import until_async
from tests.support.zenoh_router import EXAMPLES

DASHBOARDS = EXAMPLES / "fleet" / "grafana" / "dashboards"
SCHEMAS = EXAMPLES.parent / "payloads" / "schemas"
_NAME = re.compile(r"\b(?:naze_bridge|process)_[a-z_]+")
#: Metrics that exist only after an event, or only with a session.
_LATER = {"naze_bridge_missions_total", "naze_bridge_refused_frames_total", "naze_bridge_zenoh_dropped_total"}


@pytest.mark.parametrize("file", ["docker-compose.yml", "docker-compose.history.yml"])
def test_the_storages_keep_state_and_events_without_telemetry(file: str) -> None:
    compose = (EXAMPLES / "fleet" / file).read_text()
    stored = [zenoh.KeyExpr(found) for found in re.findall(r'key_expr:"([^"]+)"', compose)]

    def is_stored(key: ZenohKey) -> bool:
        return any(each.intersects(zenoh.KeyExpr(full("fleet", "kite", key.suffix))) for each in stored)

    published = [key for key in KEYS if key.is_published]
    assert {key for key in published if is_stored(key)} == {STATE, OVERVIEW, EVENT, MISSION_CURRENT, MISSION_REPORT}


def test_the_history_dashboard_shows_fields_that_the_stored_payloads_have() -> None:
    compose = (EXAMPLES / "fleet" / "docker-compose.history.yml").read_text()
    in_influxdb = set(re.findall(r'key_expr:"fleet/\*/v1/(\w+)",strip_prefix:"fleet",volume:\{id:"influxdb"', compose))
    assert in_influxdb == {"state", "event"}
    schemas = {name: json.loads((SCHEMAS / f"{name}.json").read_text()) for name in in_influxdb}
    panels = json.loads((DASHBOARDS / "history.json").read_text())["panels"]
    for panel in panels:
        (name,) = re.findall(r"\\/v1\\/(\w+)\$/ ", panel["targets"][0]["query"])
        for each in panel["transformations"][0]["options"]["jsonPaths"]:
            schema = schemas[name]
            for part in each["path"].split("."):
                schema = schema["properties"][part]
    assert len(panels) >= 5


def wanted() -> set[str]:
    dashboards = [json.loads(path.read_text()) for path in DASHBOARDS.iterdir()]
    targets = [target for each in dashboards for panel in each["panels"] for target in panel["targets"]]
    expressions = [target["expr"] for target in targets if target["datasource"]["type"] == "prometheus"]
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

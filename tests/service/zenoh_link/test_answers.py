# SPDX-License-Identifier: GPL-3.0-or-later
"""Every sample and reply, on every key and in both encodings, matches the published schemas."""

import json
from pathlib import Path
from typing import Any

import zenoh
from jsonschema import Draft202012Validator

from generators.zenoh_schemas import SCHEMAS as FOLDER
from generators.zenoh_schemas import schemas, text
from payloads.keys import COMMANDS, KEYS, MAVLINK_OUT, OVERVIEW, VERSION
from reports.vehicle_groups import Group
from tests.support.benches import Starter
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.zenoh_bench import I_KNOW, Reader, ask, ask_surely, body, endpoint, key, session, zenoh_bench

MISSION = (Path(__file__).parents[3] / "examples" / "naze-field.waypoints").read_bytes()
SCHEMAS = {key.suffix: key.schema for key in KEYS}


def validator(name: str) -> Draft202012Validator:
    schema = json.loads((FOLDER / f"{name}.json").read_text())
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def check(suffix: str, payload: Any) -> None:
    name = SCHEMAS[suffix]
    assert name is not None
    validator(name).validate(payload)


def check_all(reader: Reader) -> set[str]:
    """Check all samples and return their keys."""
    found: set[str] = set()
    for sample in reader.samples:
        suffix = str(sample.key_expr).removeprefix(key("@").removesuffix("@"))
        found.add(suffix)
        kind = "cbor" if suffix == OVERVIEW.suffix else "json"
        schema = f"naze-bridge/v{VERSION}/{SCHEMAS[suffix]}"
        assert str(sample.encoding) == (f"application/cbor;{schema}" if kind == "cbor" else "application/json")
        assert kind == "cbor" or str(sample.attachment and sample.attachment.to_string()) == schema
        check(suffix, body(sample))
    return found


def test_the_files_are_up_to_date() -> None:
    """`make zenoh-schemas` writes them."""
    wanted = {f"{name}.json": text(schema) for name, schema in schemas().items()}
    assert {path.name: path.read_text() for path in FOLDER.iterdir()} == wanted


def test_all_payloads_match_the_published_schemas(start: Starter) -> None:
    """Telemetry, accepted and refused missions, arming, the other protocol, an unplugged cable."""
    where = endpoint()
    bench = zenoh_bench(start, f'listen = ["{where}"]\n{I_KNOW}')
    with session(connect=where) as opened:
        reader = Reader(opened)
        for group in Group:
            reader.wait(f"telemetry/{group.value}")
        bench.daemon.push(plain_plan(12))
        refused = MISSION.replace(b"\t16\t", b"\t2000\t")
        for suffix, payload in {
            "mission/upload": MISSION,
            "mission/check": refused,
            "mission/clear": None,
            "status": None,
        }.items():
            for reply in ask(opened, f"{COMMANDS}/{suffix}", payload, consolidation=zenoh.ConsolidationMode.NONE):
                check(f"{COMMANDS}/{suffix.partition('?')[0]}", reply)
        ask_surely(opened, f"{COMMANDS}/mission/upload", refused)
        bench.board.set("armed 1")
        reader.wait("event", lambda event: event["event"] == "vehicle.armed")
        for suffix in ("state", "mission/current", "mission/list"):
            check(f"v{VERSION}/{suffix}", ask_surely(opened, suffix))
        bench.board.set("unplug")
        reader.wait("state", lambda state: state["link"]["flight_controller"] is None)
        until(lambda: reader.of("mission/report"), "a report")
        found = check_all(reader)
    published = {each.suffix for each in KEYS if each.is_published} - {MAVLINK_OUT.suffix}
    assert found == published

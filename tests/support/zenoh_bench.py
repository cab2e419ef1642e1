# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon on zenoh, and the test's own session."""

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import zenoh

from payloads.keys import VERSION
from payloads.payload import decoded
from tests.support.benches import Bench, Starter
from tests.support.programs import TIMEOUT_S, free_port, until

VEHICLE = "naze-1"
I_KNOW = 'commands = true\ncommands_without_authentication = "I know"\n'


def endpoint() -> str:
    return f"tcp/127.0.0.1:{free_port(socket.SOCK_STREAM)}"


def zenoh_config(table: str, vehicle: str = VEHICLE) -> str:
    """The text of a configuration with this table."""
    name_line = f'vehicle = "{vehicle}"\n' if vehicle else ""
    return f"[zenoh]\n{name_line}{table}\n"


def zenoh_bench(start: Starter, table: str, *board_options: str) -> Bench:
    """A daemon that has found a simulated board and has `table` as its [zenoh]."""
    return start.bench(*board_options, config=zenoh_config(table))


@contextmanager
def session(connect: str = "", listen: str = "") -> Iterator[zenoh.Session]:
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints", json.dumps([connect] if connect else []))
    config.insert_json5("listen/endpoints", json.dumps([listen] if listen else []))
    with zenoh.open(config) as opened:
        yield opened


def key(suffix: str, vehicle: str = VEHICLE) -> str:
    return f"fleet/{vehicle}/{suffix if suffix.startswith('@') else f'v{VERSION}/{suffix}'}"


def body(data: zenoh.Sample | zenoh.ReplyError) -> Any:
    """The content of a sample, a reply or an error."""
    return decoded(data.payload.to_bytes(), str(data.encoding))


class Reader:
    """Keeps the samples of a key expression."""

    def __init__(self, opened: zenoh.Session, expression: str = "fleet/**") -> None:
        self.samples: list[zenoh.Sample] = []
        self._subscriber = opened.declare_subscriber(expression, self.samples.append)

    def of(self, suffix: str, vehicle: str = VEHICLE) -> list[Any]:
        return [body(sample) for sample in self.samples[:] if str(sample.key_expr) == key(suffix, vehicle)]

    def wait(self, suffix: str, condition: Callable[[Any], object] = lambda _: True) -> Any:
        """Return the first sample of a key that meets a condition."""
        return until(lambda: next(filter(condition, self.of(suffix)), None), f"{suffix} as it should be")

    def events(self, name: str) -> list[Any]:
        return [each["facts"] for each in self.of("event") if each["event"] == name]


def ask(
    opened: zenoh.Session, suffix: str, payload: bytes | None = None, *, vehicle: str = VEHICLE, **options: Any
) -> list[Any]:
    """Return all replies, errors included."""
    replies = opened.get(key(suffix, vehicle), payload=payload, timeout=TIMEOUT_S, **options)
    return [body(reply.ok or reply.err) for reply in replies]


def ask_surely(opened: zenoh.Session, suffix: str, payload: bytes | None = None, **options: Any) -> Any:
    """Return the last reply; ask again until the vehicle is present."""
    return until(lambda: ask(opened, suffix, payload, **options), f"an answer to {suffix}")[-1]

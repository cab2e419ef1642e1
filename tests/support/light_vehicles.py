# SPDX-License-Identifier: GPL-3.0-or-later
"""Thousands of vehicles as `fleet list` sees them, in one process.

`python -m tests.support.light_vehicles ENDPOINT COUNT PERIOD [SILENT]`: a few sessions stand for all. For each vehicle
they declare a liveliness token and a publisher, send its overview every PERIOD seconds, and answer the query; the last
SILENT have only a token. Every fiftieth is armed.
"""

import json
import struct
import sys
import time
from collections.abc import Callable, Sequence

import zenoh

from payloads.keys import OVERVIEW
from payloads.mission_data import plain
from payloads.overview import Overview, packed
from payloads.payload import encoding_of

SESSIONS = 20
_ENCODING = encoding_of(OVERVIEW)
#: In place of the time, which is the same in all overviews: packing each again would take most of a core.
_MARK = b"TIME"


def main(endpoint: str, count: int, period_s: float, silent: int = 0) -> None:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    sessions = [zenoh.open(config) for _ in range(min(SESSIONS, count))]
    payloads = [_overview(number) for number in range(count - silent)]
    held: list[object] = [
        session.declare_queryable(
            f"fleet/*/{OVERVIEW.suffix}", _answer(payloads, range(first, len(payloads), SESSIONS))
        )
        for first, session in enumerate(sessions)
    ]
    publishers = [
        sessions[number % SESSIONS].declare_publisher(
            _key(number), encoding=_ENCODING, congestion_control=zenoh.CongestionControl.DROP
        )
        for number in range(len(payloads))
    ]
    for number in range(count):
        session = sessions[number % SESSIONS]
        held.append(session.liveliness().declare_token(f"fleet/{name(number)}/v1/alive/{session.zid()}"))
    began_at, sent = time.monotonic(), 0
    while True:
        due = int((time.monotonic() - began_at) * len(payloads) / period_s)
        for at in range(sent, due):
            number = at % len(payloads)
            publishers[number].put(_now(payloads[number]))
        sent = due
        time.sleep(0.02)


def name(number: int) -> str:
    return f"light-{number}"


def _key(number: int) -> str:
    return f"fleet/{name(number)}/{OVERVIEW.suffix}"


def _overview(number: int) -> bytes:
    armed = number % 50 == 0
    overview = Overview(
        *("MSP", armed, "AUTO" if armed else "ACRO", 1234, 453838000 + number, 84733000, 20, 146, 0xABCD),
        *(number % 360, 25, 3, None),
    )
    return packed({"v": 1, "seq": 0, "time_s": int.from_bytes(_MARK, "big")} | plain(overview))


def _now(payload: bytes) -> bytes:
    return payload.replace(_MARK, struct.pack(">I", round(time.time())))


def _answer(payloads: Sequence[bytes], numbers: range) -> Callable[[zenoh.Query], None]:
    def answer(query: zenoh.Query) -> None:
        with query:
            for number in numbers:
                query.reply(_key(number), _now(payloads[number]), encoding=_ENCODING)

    return answer


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), *map(int, sys.argv[4:]))

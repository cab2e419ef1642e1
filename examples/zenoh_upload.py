# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a mission to one vehicle: `python zenoh_upload.py VEHICLE FILE [ENDPOINT]`. Needs `pip install eclipse-zenoh`.

The vehicle must accept commands: `commands = true` in its [zenoh] table, docs/zenoh.md.
"""

import argparse
import json
import sys
from pathlib import Path

import zenoh


def main(vehicle: str, file: str, endpoint: str) -> int:
    """Print the progress and the result; returns the exit status."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session:
        replies = session.get(
            f"fleet/{vehicle}/@cmd/v1/mission/upload",
            payload=Path(file).read_bytes(),
            timeout=120.0,
            # Without this only the last reply arrives, without the progress before it.
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        for reply in replies:
            if reply.err is not None:
                print("Refused:", reply.err.payload.to_string())
                return 1
            assert reply.ok is not None
            answer = json.loads(reply.ok.payload.to_bytes())
            if "result" in answer:
                print(answer["result"]["text"])
                for finding in answer["result"]["findings"]:
                    print(" ", finding)
                return 0
            print(f"{answer['progress']} of {answer['of']} records", flush=True)
    print("No answer: is the vehicle there, and does it take commands?")
    return 1


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("vehicle")
    arguments.add_argument("file", help="QGC WPL 110 or a .plan")
    arguments.add_argument("endpoint", nargs="?", default="tcp/localhost:7447", help="the router, or the vehicle")
    given = arguments.parse_args()
    sys.exit(main(given.vehicle, given.file, given.endpoint))

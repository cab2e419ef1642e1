# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints every vehicle's position: `python zenoh_positions.py [ENDPOINT]`. Needs `pip install eclipse-zenoh`.

Fields and units: docs/zenoh-payloads.md.
"""

import argparse
import json
import time

import zenoh


def main(endpoint: str) -> None:
    """Print a line for each received position, until Ctrl-C."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    newest: dict[str, int] = {}
    least_delay_s: dict[str, float] = {}

    def heard(sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        vehicle = key.split("/")[1]
        position = json.loads(sample.payload.to_bytes())
        # The sequence numbers of a key have no gaps: a missing one was lost on the way, which telemetry permits.
        lost = position["seq"] - newest.get(key, position["seq"] - 1) - 1
        newest[key] = position["seq"]
        # After a stall, samples from queues arrive late. The least delay seen is the difference between the clocks.
        delay_s = time.time() - position["time_s"]
        least_delay_s[key] = min(delay_s, least_delay_s.get(key, delay_s))
        late_s = delay_s - least_delay_s[key]
        place = (position["lat_deg"], position["lon_deg"], position["height_m"])
        remarks = [f", {lost} lost before"] * (lost > 0) + [f", {late_s:.0f} s old"] * (late_s > 1)
        print(f"{vehicle}: lat, lon, height {place}{''.join(remarks)}", flush=True)

    with zenoh.open(config) as session, session.declare_subscriber("fleet/*/v1/telemetry/position", heard):
        try:
            while True:
                time.sleep(1)
        except KeyboardInterrupt:
            print()


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("endpoint", nargs="?", default="tcp/localhost:7447", help="the router, or one vehicle")
    main(arguments.parse_args().endpoint)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The data volume of a vehicle's uplink, with TCP and IP headers: `python -m benchmarks.zenoh_volume [SECONDS]`.

A real daemon on a simulated flight controller is a client of a router ($ZENOHD, or that of the Python package); each
line is another subscriber there, and both profiles. The kernel's counters of the daemon's connection (`ss -ti`) give
payload bytes and segments of both directions; each segment has 52 bytes of headers (IPv4 and TCP with timestamps).
Behind a mobile link acknowledgements may be fewer, as on Ethernet.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from socket import SOCK_STREAM

from benchmarks.processes import ROOT, running, wait_for
from tests.support.programs import NAZE_BRIDGE, free_port
from tests.support.zenoh_router import client, running_router

_SECONDS = 60.0
_HEADERS = 52
#: The keys of each kind of subscription.
_READERS = {
    "nothing": (),
    "overview": ("overview",),
    "overview, event, mission": ("overview", "event", "mission/**"),
    "state, overview, event, mission": ("state", "overview", "event", "mission/**"),
    "everything": ("**",),
}
_COUNTERS = ("bytes_sent", "bytes_received", "segs_out", "segs_in")


def main(seconds: float) -> None:
    """Print a table: bytes a second and GB in 30 days."""
    print("profile  encoding  subscribed to                     B/s up  B/s down  segments/s  GB in 30 days")
    for profile, encoding in (("full", "json"), ("metered", "json"), ("metered", "cbor")):
        with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
            folder, port = Path(name), free_port(SOCK_STREAM)
            endpoint = f"tcp/127.0.0.1:{port}"
            stack.enter_context(running_router(folder, endpoint))
            config = folder / "config.toml"
            config.write_text(
                f'[zenoh]\nvehicle = "kite"\nconnect = ["{endpoint}"]\nprofile = "{profile}"\nencoding = "{encoding}"\n'
            )
            command = [*NAZE_BRIDGE, "run", "--fc", "sim:", "--gcs", f"udpin:127.0.0.1:{free_port()}",
                       "--state-dir", str(folder), "--config", str(config)]  # fmt: skip
            daemon = stack.enter_context(running(command, folder / "daemon.log"))
            with client(endpoint) as session:
                wait_for(lambda: any(session.get("fleet/kite/v1/state", timeout=2)), "the vehicle is up", 60)
                for title, keys in _READERS.items():
                    readers = [session.declare_subscriber(f"fleet/*/v1/{key}", lambda _: None) for key in keys]
                    time.sleep(5)
                    before = _counters(daemon.pid, port)
                    time.sleep(seconds)
                    now = _counters(daemon.pid, port)
                    _print(f"{profile:7}  {encoding:8}  {title:32}", before, now, seconds)
                    for reader in readers:
                        reader.undeclare()  # type: ignore[no-untyped-call]


def _print(title: str, before: dict[str, int], now: dict[str, int], seconds: float) -> None:
    sent, received, out, into = ((now[name] - before[name]) / seconds for name in _COUNTERS)
    up, down = sent + _HEADERS * out, received + _HEADERS * into
    gigabytes = (up + down) * 30 * 86400 / 1e9
    print(f"{title} {up:7.0f} {down:9.0f} {out + into:11.2f} {gigabytes:14.2f}", flush=True)


def _counters(pid: int, port: int) -> dict[str, int]:
    """The counters of the daemon's connection to the router."""
    command = ["/usr/bin/ss", "-tinpH", f"dport = {port}"]
    found = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    (_, after) = found.split(f"pid={pid},", 1)
    return {name: int((re.search(rf"\b{name}:(\d+)", after) or [0, 0])[1]) for name in _COUNTERS}


if __name__ == "__main__":
    os.chdir(ROOT)
    main(float(sys.argv[1]) if len(sys.argv) > 1 else _SECONDS)

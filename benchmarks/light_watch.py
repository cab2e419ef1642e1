# SPDX-License-Identifier: GPL-3.0-or-later
"""`fleet watch` and `list` of thousands of vehicles: `python -m benchmarks.light_watch [COUNT [PERIOD]]`.

The vehicles (tests/support/light_vehicles.py, an overview every PERIOD seconds), the router ($ZENOHD, or that of the
Python package) and the commands run in processes of their own, on the loopback. A fiftieth of the vehicles is armed,
none has a problem. CPU time and memory are those of the command alone.
"""

import json
import os
import pty
import re
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from socket import SOCK_STREAM

import zenoh

from benchmarks.processes import ROOT, cpu_s, resident_mb, running, wait_for
from tests.support import light_vehicles
from tests.support.programs import NAZE_BRIDGE, free_port
from tests.support.zenoh_router import client, running_router

_COUNT = 10_000
#: The period of the overviews.
_PERIOD_S = 10.0
_WATCHED_S = 30.0
_LISTS = 3
#: The time that the router takes for each token grows with their number.
_OPENING_S = 900.0


def main(count: int, period_s: float) -> None:
    """Print what watch and list show, and their cost."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        endpoint = f"tcp/127.0.0.1:{free_port(SOCK_STREAM)}"
        stack.enter_context(running_router(Path(name), endpoint))
        log = Path(name) / "vehicles.log"
        command = [sys.executable, "-m", light_vehicles.__name__, endpoint, str(count), str(period_s)]
        stack.enter_context(running(command, log))
        began_at = time.monotonic()
        with client(endpoint) as session:
            wait_for(partial(_are_up, session, count), "the vehicles are up", _OPENING_S)
        print(f"the router knows all {count} after {time.monotonic() - began_at:.0f} s", flush=True)
        for _ in range(_LISTS):
            _list(endpoint, count)
        _watch(endpoint, count)


def _list(endpoint: str, count: int) -> None:
    began_at = time.monotonic()
    command = [*NAZE_BRIDGE, "fleet", "list", "--json", "--connect", endpoint]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    took_s = time.monotonic() - began_at
    if not listed.stdout:
        print(f"list: exit code {listed.returncode} after {took_s:.1f} s, {listed.stderr.strip()}", flush=True)
        return
    found = json.loads(listed.stdout)
    heard = sum(vehicle["answers"] for vehicle in found["vehicles"])
    print(f"list: {heard} of {count} in {took_s:.2f} s, exit code {listed.returncode}", flush=True)


def _watch(endpoint: str, count: int) -> None:
    """Run watch on a terminal; its head line, CPU time and memory."""
    own, its = pty.openpty()
    began_at = time.monotonic()
    command = [*NAZE_BRIDGE, "fleet", "watch", "--connect", endpoint]
    environment = os.environ | {"COLUMNS": "80", "LINES": "24", "TERM": "xterm"}
    watch = subprocess.Popen(command, cwd=ROOT, stdin=its, stdout=its, stderr=its, env=environment)
    os.set_blocking(own, False)
    seen, complete_s = b"", None
    try:
        before_s = 0.0
        while (elapsed_s := time.monotonic() - began_at) < _PERIOD_S + _WATCHED_S:
            time.sleep(0.1)
            with suppress(BlockingIOError):
                seen = (seen + os.read(own, 1 << 20))[-20_000:]
            if complete_s is None and re.search(rb"(?<!of )%b vehicles, " % f"{count:,}".encode(), seen):
                complete_s = elapsed_s
            if not before_s and elapsed_s > _PERIOD_S:
                before_s = cpu_s(watch.pid)
        percent = 100 * (cpu_s(watch.pid) - before_s) / _WATCHED_S
        heads = re.findall(rb"(?:Heard [\d,]+ of )?[\d,]+ vehicles, [^\r\n\x1b]*", seen)
        when = "never" if complete_s is None else f"{complete_s:.1f} s after its start"
        print(f"watch: complete {when}; {heads[-1].decode() if heads else 'nothing shown'}", flush=True)
        print(f"watch: {percent:.1f} % of a core, {resident_mb(watch.pid):.0f} MB", flush=True)
    finally:
        watch.kill()
        watch.wait()


def _are_up(session: zenoh.Session, count: int) -> bool:
    """True if the router knows the last token of each session. Listing all takes it half a second each time."""
    time.sleep(1.0)
    last = map(light_vehicles.name, range(max(count - light_vehicles.SESSIONS, 0), count))
    return all(any(session.liveliness().get(f"fleet/{each}/v1/alive/*", timeout=30)) for each in last)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else _COUNT, float(sys.argv[2]) if len(sys.argv) > 2 else _PERIOD_S)

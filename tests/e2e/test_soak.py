# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon at full rate under events and attacks of all kinds for 12 s; `make soak` runs longer."""

import os
import random
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from socket import SOCK_STREAM
from typing import Any

import pytest

from tests.support.benches import Starter
from tests.support.programs import free_port, until
from tests.support.soak import BoardEvents, Crowd, HeartbeatMonitor, Meter, Stalls

MINUTES = float(os.environ.get("SOAK_MINUTES", "0.2"))
SEED = int(os.environ.get("SOAK_SEED", "1"))
#: SQLite's page cache grows to 2 MB, and Python seldom returns memory.
MEMORY_KB = 3000
#: The simulated board's counters of harmful events. Not overflows of its receive ring: they are unavoidable if it
#: hangs during two chunks, and the checksum detects them.
TRAPS = ("hazard_runs", "tx_overflows", "cli_entered")
#: Of the 200 that one address has, with room for those after the events.
WRITES = 160
#: Ground stations report a lost link after 3 to 3.5 s.
LONGEST_GAP_S = 2.0
#: Each value arms differently.
TELE_PROTS = (2, 0, 3, 1)


@pytest.mark.timeout(60 * MINUTES + 600)
def test_a_daemon_survives_events_and_attacks_at_full_rate(
    start: Starter, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port = tmp_path / "naze-by-id"
    udp_port, tcp_port = free_port(), free_port(SOCK_STREAM)
    daemon = start.daemon(str(port), gcs=[f"udpin:127.0.0.1:{udp_port}", f"tcpin:127.0.0.1:{tcp_port}"])
    daemon.wait_up()
    meter = Meter(daemon.process.pid)
    crowd = Crowd(daemon, udp_port, tcp_port, random.Random(SEED), 60 * MINUTES / WRITES)
    stalls = Stalls()
    monitor = HeartbeatMonitor(("127.0.0.1", udp_port), stalls, daemon.process.pid)
    board_events: list[BoardEvents] = []
    boards: list[dict[str, Any]] = []
    memory_kb: list[int] = []
    descriptors: list[int] = []
    with ExitStack() as stack:
        for watch in (stalls, monitor):
            watch.start()
            stack.callback(watch.end)
        for number, tele_prot in enumerate(TELE_PROTS):
            folder = tmp_path / f"board {number}"
            folder.mkdir()
            board = Starter(folder, stack).board("--tele-prot", str(tele_prot), "--state", str(tmp_path / "flash"))
            port.unlink(missing_ok=True)
            port.symlink_to(board.link)
            board_events.append(BoardEvents(board, random.Random(SEED + number)))
            board_events[-1].start()
            end = time.monotonic() + 60 * MINUTES / len(TELE_PROTS)
            while time.monotonic() < end:
                crowd.act(board)
            board_events[-1].end()
            # After the events end, everything works.
            crowd.leave()
            daemon.wait()
            until(partial(crowd.try_upload, board), "a mission without disturbances")
            assert daemon.pull()["records"] == board.records()
            boards.append({name: value for name, value in board.stats().items() if name in TRAPS})
            memory_kb.append(meter.memory_kb())
            descriptors.append(_settled(meter))
            board.end()
        until(lambda: daemon.has_logged("fc.port_lost"), "the loss of the port")
    happened = sum((each.happened for each in board_events), crowd.happened)
    report = (
        f"seed {SEED}, {MINUTES} min: {dict(happened)}; uploads {dict(crowd.uploads)};"
        f" {monitor.frames.total()} frames, {monitor.frames[30]} attitudes; longest gap {max(monitor.gaps_s):.2f} s;"
        f" memory {memory_kb} kB, descriptors {descriptors}; boards {boards}"
    )
    with capsys.disabled():
        print(f"\n{report}")  # noqa: T201 (what a long soak is made for)
    assert all(set(traps.values()) == {0} for traps in boards), report
    assert monitor.damaged == []
    assert max(monitor.gaps_s) <= LONGEST_GAP_S
    # A station that has left keeps its socket until another one connects.
    assert max(descriptors) - min(descriptors) <= 32, report
    # The first board's part loads code and fills SQLite's cache.
    assert memory_kb[-1] - memory_kb[1] <= MEMORY_KB, report
    assert "Traceback" not in daemon.printed
    assert [entry for entry in daemon.events() if entry["level"] == "error"] == []
    assert daemon.is_alive


def _settled(meter: Meter) -> int:
    """The number of open descriptors once those of earlier clients are closed."""
    counts = [len(meter.descriptors())]
    while len(counts) < 10 or len(set(counts[-10:])) > 1:
        time.sleep(0.1)
        counts.append(len(meter.descriptors()))
    return counts[-1]

# SPDX-License-Identifier: GPL-3.0-or-later

import random
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from storage.mission_store import MissionStore, ReceivedMission, open_store


def mission(tag: int, items: int = 3) -> ReceivedMission:
    """A mission in which every part depends on `tag`."""
    records = random.Random(tag).randbytes(16 * items)
    return ReceivedMission(
        received_at=1_700_000_000.25 + tag,
        source=f"udp 192.168.4.2:{tag} sysid 255",
        items=[{"seq": seq, "command": 16, "p1": float("inf"), "lat_e7": tag} for seq in range(items)],
        verdict="ACCEPTED",
        ack="MAV_MISSION_ACCEPTED",
        findings=[{"seq": 1, "field": "p2", "was": tag, "becomes": 2, "why": "below gps_wp_radius"}],
        stored_items=[{"seq": seq, "command": 16, "alt_m": tag} for seq in range(items)],
        records=records,
        record_count=items,
        checksum=zlib.crc32(records),
        roi_commands={tag: 201},
        sent_seqs=[*range(items)],
    )


@contextmanager
def intact(path: Path) -> Iterator[MissionStore]:
    """The store at this path, which is opened without loss."""
    opened = open_store(path, now=0.0)
    with opened.store as store:
        assert opened.set_aside is None
        yield store


def received(store: MissionStore, number: int) -> ReceivedMission:
    """The mission with this number as it was received."""
    stored = store.get(number)
    assert stored is not None
    return stored.received

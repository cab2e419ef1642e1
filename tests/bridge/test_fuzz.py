# SPDX-License-Identifier: GPL-3.0-or-later
"""Anything over UDP, the UART and in files: nothing raises.

`make fuzz` draws more of it. What failed is kept in .hypothesis/fuzz and drawn first the next time.
"""

import os
from contextlib import suppress

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.database import DirectoryBasedExampleDatabase

from protocols.mavlink.codec import FrameWriter, Packed
from protocols.mavlink.dialect import CRC_EXTRA
from protocols.mission_file import MissionFileError, read_mission_file
from protocols.msp.frame import Direction, MspFrame
from tests.support.world import GroundStation, World

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "150"))
#: In one example, so that what one input leaves behind meets the next.
AT_ONCE = 20
_fuzz = settings(
    max_examples=EXAMPLES,
    database=DirectoryBasedExampleDatabase(".hypothesis/fuzz"),
    suppress_health_check=list(HealthCheck),
)

noise = st.binary(max_size=300)
frames = st.builds(
    lambda msgid, payload, sysid, version: FrameWriter(sysid, 190).frame(
        Packed(msgid, payload, payload or b"\0"), version
    ),
    st.sampled_from(sorted(msgid for msgid in CRC_EXTRA if msgid < 256)),
    st.binary(max_size=255),
    st.integers(0, 255),
    st.sampled_from((1, 2)),
)
replies = st.builds(
    lambda direction, command, payload: MspFrame(direction, command, payload).encode(),
    st.sampled_from(list(Direction)),
    st.integers(0, 255),
    st.binary(max_size=255),
)


def cut(whole: st.SearchStrategy[bytes]) -> st.SearchStrategy[bytes]:
    """Frames as they are, cut, or behind noise."""
    short = st.builds(lambda data, end: data[:end], whole, st.integers(0, 300))
    return whole | short | st.builds(lambda before, data: before + data, noise, whole)


@_fuzz
@given(st.lists(st.tuples(st.integers(0, 3), cut(frames) | noise, st.booleans()), max_size=AT_ONCE))
def test_ground_stations(spoken: list[tuple[int, bytes, bool]]) -> None:
    world = World(speeds=(115200,))
    world.wait_ready()
    stations = [GroundStation(world, str(number), sysid=250 + number) for number in range(4)]
    for number, data, is_datagram in spoken:
        world.spoken_by(stations[number], data, datagram=is_datagram)
        world.run(0.01)
    world.run(1)


@_fuzz
@given(st.lists(cut(replies) | cut(frames) | noise, max_size=AT_ONCE), st.booleans())
def test_the_uart(heard: list[bytes], is_found: bool) -> None:
    world = World(speeds=(115200,))
    if is_found:
        world.wait_ready()
    for data in heard:
        world.hear(data)
        world.run(0.01)
    world.run(1)


@_fuzz
@given(
    st.binary(max_size=2000)
    | st.text(max_size=500).map(lambda text: ("QGC WPL 110\n" + text).encode())
    | st.lists(st.text("0123456789.-eNaIn \t", max_size=30), max_size=40).map(
        lambda words: ("QGC WPL 110\n" + "\t".join(words)).encode()
    )
    | st.text('{}[]",:0123456789.eE-missionitemsfileType ', max_size=400).map(str.encode)
)
def test_mission_files(data: bytes) -> None:
    with suppress(MissionFileError):
        read_mission_file(data, "fuzz")

# SPDX-License-Identifier: GPL-3.0-or-later
"""The same conversation with the image and the simulated Naze must give the same replies."""

import random

from protocols.mission_item import identify, pack_records
from protocols.msp.frame import MspFrame, request
from protocols.msp.mission import (
    ABORT_REQUEST,
    INFO_REQUEST,
    WpRecord,
    encode_begin,
    encode_chunk,
    encode_commit,
    encode_read,
)
from simulator.board.msp_sensors import MspCommand as Msp
from simulator.board.options import SimOptions, Tree
from simulator.emulated_naze.image import Image
from simulator.naze.replies import encode_radius
from tests.support.naze_bench import Bench, WireBench, mission
from tests.support.real_bench import Figure, RealBench

_EXCHANGES = 100
#: Longer than any reply and any write of the configuration.
_EXCHANGE_S = 0.5
#: Measurements and the pilot's settings, of which only the lengths must be equal.
_MEASURED = {Msp.STATUS, Msp.RAW_IMU, Msp.RC, Msp.RAW_GPS, Msp.COMP_GPS, Msp.ATTITUDE, Msp.ALTITUDE, Msp.ANALOG}
_MEASURED |= {Msp.DEBUG, Msp.MOTOR, Msp.WP}
#: Replies with settings of this craft, which the model does not have.
_SETTINGS = frozenset((Msp.RC_TUNING, Msp.PID, Msp.BOX, Msp.SERVO, Msp.MISC))
_READS = tuple(command for command in Msp if command < Msp.WP)


def test_image_and_model_reply_alike_in_a_hundred_exchanges(image: Image, flash: bytes, figure: Figure) -> None:
    real = RealBench(image, flash)
    boxes = real.payload(request(Msp.BOXNAMES))
    model = Bench(SimOptions(tree=Tree.TESTCODE3 if b"PASSTHRU" in boxes else Tree.WEBSTORE1))
    assert model.payload(request(Msp.BOXNAMES)) == boxes
    dice = random.Random(13)
    different = []
    lists = [mission(count, seed) for count in (0, 1, 15, 40) for seed in (1, 2)]
    records = lists[0]
    for number in range(_EXCHANGES):
        if not number % 10:
            records = dice.choice(lists)
        frame = dice.choice(requests(dice, records))
        begun = [bench.now for bench in (real, model)]
        answers = [ask(bench, frame) for bench in (real, model)]
        # The same time for both, because a transfer is dropped after 5 s.
        for bench, at in zip((real, model), begun, strict=True):
            bench.run(at + _EXCHANGE_S - bench.now)
        if comparable(frame, answers[0]) != comparable(frame, answers[1]):
            different.append(f"{frame.hex()}: image {answers[0]!r}, model {answers[1]!r}")
    figure("exchanges that differ from the model's", f"{len(different)} of {_EXCHANGES}")
    assert not different, "\n".join(different)


def requests(dice: random.Random, records: list[WpRecord]) -> list[bytes]:
    """Requests of each kind; those of an upload are mostly in a valid order."""
    identity = identify(records)
    first = dice.choice((0, 0, 14, 15, 30))
    return [
        request(dice.choice(_READS)),
        request(Msp.WP, bytes((dice.choice((0, 16, 3)),))),
        request(dice.choice((1, 99, 189, 197, 209, 253)), dice.choice((b"", b"\r\r\r###RRR"))),
        INFO_REQUEST,
        encode_begin(identity),
        encode_chunk(pack_records(records), first, 15).frame if first < len(records) else INFO_REQUEST,
        encode_commit(identity),
        ABORT_REQUEST,
        encode_read(dice.choice((0, 3, 39)), dice.choice((1, 6))),
        encode_radius(dice.choice((100, 200, 2001))),
    ]


def ask(bench: WireBench, frame: bytes) -> MspFrame | bytes | None:
    """The reply, or its bytes if malformed."""
    before = len(bench.received)
    answer = bench.ask(frame, 0.4)
    return answer or bytes(bench.received[before:]) or None


def comparable(frame: bytes, answer: MspFrame | bytes | None) -> object:
    command = frame[4]
    if isinstance(answer, MspFrame) and command in _MEASURED | _SETTINGS:
        return answer.direction, answer.command, len(answer.payload)
    return answer

# SPDX-License-Identifier: GPL-3.0-or-later
"""Payloads: readable by their encoding, numbered for each key."""

import pytest

from payloads.keys import EVENT, STATE, STATUS, PayloadEncoding
from payloads.payload import Payloads, decoded


@pytest.mark.parametrize("encoding", PayloadEncoding)
def test_a_reply_reads_back_by_its_encoding(encoding: PayloadEncoding) -> None:
    payloads = Payloads(encoding, lambda: 1790000000.5)
    read = decoded(payloads.reply(STATE, {"vehicle": "kite"}), str(payloads.encoding(STATE)))
    assert read == {"v": 1, "seq": 0, "time_s": 1790000000.5, "vehicle": "kite"}


def test_each_key_counts_its_own_samples() -> None:
    payloads = Payloads(PayloadEncoding.JSON, lambda: 0.0)
    assert [payloads.head(key)["seq"] for key in (STATE, STATE, EVENT, STATE)] == [0, 1, 0, 2]
    assert decoded(payloads.reply(STATE, {}), "application/json")["seq"] == 2


def test_the_reply_to_a_command_is_json_without_a_number() -> None:
    payloads = Payloads(PayloadEncoding.CBOR, lambda: 0.0)
    assert decoded(payloads.reply(STATUS, {"ok": True}), str(payloads.encoding(STATUS))) == {"ok": True}

# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes that open a board's command line, and the echo of a board in it."""

from hypothesis import given
from hypothesis import strategies as st

from protocols.msp.command_line import EchoWatch, typed_and_rubbed_out
from protocols.msp.frame import is_clean, request

#: Three of one of these in a row open a Harakiri's command line, or reset it.
HAZARDS = (0x0D, 0x23, 0x52)


IDENT = request(100)
_BYTES = st.binary(max_size=30) | st.lists(st.sampled_from(HAZARDS), max_size=8).map(bytes)


@given(frames=st.lists(_BYTES, max_size=6), lost=st.sets(st.integers(0, 200)))
def test_clean_frames_never_form_a_run_when_bytes_are_lost(frames: list[bytes], lost: set[int]) -> None:
    sent = b"".join(frame for frame in frames if is_clean(frame))
    received = bytes(byte for at, byte in enumerate(sent) if at not in lost)
    assert all(bytes((hazard,)) * 3 not in received for hazard in HAZARDS)


def test_every_printable_byte_is_rubbed_out() -> None:
    line = bytearray()
    for byte in typed_and_rubbed_out(IDENT):
        if byte == 0x7F:
            del line[-1:]
        elif ord(" ") <= byte <= ord("~"):
            line.append(byte)
    assert not line


def test_two_echoed_requests_are_a_command_line_but_not_a_single_echo() -> None:
    watch = EchoWatch()
    watch.sent.extend((IDENT, IDENT, IDENT))
    typed = IDENT.replace(b"\0", b"")
    watch.feed(typed)
    assert not watch.is_echo()
    watch.feed(typed)
    assert watch.is_echo()


def test_another_boards_reply_is_not_an_echo() -> None:
    watch = EchoWatch()
    watch.sent.extend((IDENT, IDENT, IDENT))
    watch.feed(b"$M>\x07d\xf0\x03\0\0\0\0\0\x94" * 4)
    assert not watch.is_echo()


def test_a_header_echoed_behind_the_prompt_is_a_command_line() -> None:
    """Of FLIGHT, command 179, only the header comes back."""
    watch = EchoWatch()
    watch.feed(b"wpflush\t clear wp list\r\n\r\n# ")
    assert not watch.is_echo()
    watch.feed(b"$M<ee$M<")
    assert watch.is_echo()

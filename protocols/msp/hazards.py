# SPDX-License-Identifier: GPL-3.0-or-later
"""The bytes that Harakiri acts on anywhere in the stream, and how frames avoid them.

Three 0x0D in a row enter the CLI, in AUTOSENSE three '#' do so too and three 'R' reset the board (serial.c, serialCom).
The firmware counts inside frames and across their boundaries. See docs/msp-mission.md, "Masked bodies".
"""

HAZARDS = frozenset((0x0D, 0x23, 0x52))
RUN_LENGTH = 3


def is_clean(frame: bytes) -> bool:
    """True if `frame` contains no hazard byte, so that no run can form, not even across frames or after a loss."""
    return HAZARDS.isdisjoint(frame)


def find_mask(body: bytes, fixed_xor: int) -> int | None:
    """Find the smallest mask that keeps mask, masked body and checksum free of hazards.

    `body` has an even length; `fixed_xor` is the XOR of the frame's other checksummed bytes (size and command).
    None if there is no such mask, which cannot happen for bodies of up to 83 bytes.
    """
    present = set(body)
    checksum_without_mask = fixed_xor
    for byte in body:
        checksum_without_mask ^= byte
    for mask in range(256):
        if (
            mask not in HAZARDS
            and checksum_without_mask ^ mask not in HAZARDS
            and all(hazard ^ mask not in present for hazard in HAZARDS)
        ):
            return mask
    return None


def apply_mask(body: bytes, mask: int) -> bytes:
    """XOR every byte of `body` with `mask`; the same call removes the mask."""
    return bytes(byte ^ mask for byte in body)

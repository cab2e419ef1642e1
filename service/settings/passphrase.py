# SPDX-License-Identifier: GPL-3.0-or-later
"""Passphrases of signing keys: how hard they are to guess, and new keys.

Anyone who records one signed packet can try passphrases on it, without the bridge noticing: a key is the passphrase's
SHA-256, of which a graphics card computes thousands of millions a second.
"""

import math
import secrets
import string

#: Too many bits to guess.
LEAST_BITS = 80
#: Without characters that look alike, and without capitals to type on a phone.
_ALPHABET = "abcdefghjkmnpqrstvwxyz23456789"
_GROUPS, _GROUP_SIZE = 4, 5
#: Characters that a guesser has to try for each class in use; others count as 100.
_CLASSES = (string.ascii_lowercase, string.ascii_uppercase, string.digits, string.punctuation + " ")
_OTHERS = 100


def new_passphrase() -> str:
    """A random passphrase of 98 bits to type in: "k7mq2-x9tvb-3hndc-pw4ea"."""
    groups = ("".join(secrets.choice(_ALPHABET) for _ in range(_GROUP_SIZE)) for _ in range(_GROUPS))
    return "-".join(groups)


def most_bits(passphrase: str) -> float:
    """An upper bound of a passphrase's entropy: words and names that a person chose have far less.

    Each character counts with the classes of characters in use, but not if it repeats or continues the one before
    ("aa", "ab", "21"), or if both have already followed each other ("qwertqwert").
    """
    known = "".join(each for each in _CLASSES if not set(each).isdisjoint(passphrase))
    choices = len(known) + (_OTHERS if any(each not in known for each in passphrase) else 0)
    pairs = {*zip(" " + passphrase, passphrase, strict=False)}
    return sum(math.log2(choices) for before, each in pairs if abs(ord(each) - ord(before)) > 1)


def weakness(passphrase: str) -> str | None:
    """Why a passphrase is weak, after "the key", or None if it is not known to be."""
    bits = most_bits(passphrase)
    return None if bits >= LEAST_BITS else f"is weak: {bits:.0f} bits at most, but {LEAST_BITS} withstand guessing"

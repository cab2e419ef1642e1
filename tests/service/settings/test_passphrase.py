# SPDX-License-Identifier: GPL-3.0-or-later
"""Weak and strong passphrases of signing keys."""

import math

import pytest

from service.settings.passphrase import LEAST_BITS, most_bits, new_passphrase, weakness


@pytest.mark.parametrize(
    "passphrase",
    [
        "x",
        "secret",
        "correct horse",
        "12345678901234567890123456789",
        "a" * 60,
        "abcdefghijklmnopqrstuvwxyz",
        "qwertz" * 10,
        "a" * 3 + "b" * 99,
        "naze1naze1naze1naze1naze1",
        "Passw0rd!",
        "Grüße",
    ],
)
def test_short_repeated_and_sequential_keys_are_weak(passphrase: str) -> None:
    why = weakness(passphrase)
    assert why is not None
    assert passphrase not in why


@pytest.mark.parametrize(
    "passphrase",
    ["k7mq2-x9tvb-3hndc-pw4ea", "xkqzvhwtmpfrbgjydsn", "7Gh!pQ2z#Lw9Rt", "8305719264024681359703847"],
)
def test_long_random_keys_are_strong(passphrase: str) -> None:
    assert weakness(passphrase) is None


def test_a_character_more_is_never_easier_to_guess() -> None:
    text = "aab naze-NAZE 123 ä#"
    bits = [most_bits(text[:end]) for end in range(len(text) + 1)]
    assert bits == sorted(bits)
    assert bits[0] == 0


def test_a_new_key_is_random_strong_and_easy_to_type() -> None:
    made = {new_passphrase() for _ in range(200)}
    assert len(made) == 200
    letters = set("".join(made)) - {"-"}
    assert letters.isdisjoint("01ilou")
    for each in made:
        assert each.isascii()
        assert len(each.replace("-", "")) * math.log2(len(letters)) > LEAST_BITS
        assert weakness(each) is None

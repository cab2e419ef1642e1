# SPDX-License-Identifier: GPL-3.0-or-later
"""The token required by every request except reading."""

import hmac
import secrets
import stat
from pathlib import Path

from storage.os_error import reason
from storage.small_files import read_bounded, replace_file

DEFAULT_NAME = "web-token"
#: Letters and digits that are easy to type on a phone and to tell apart: 16 of them are 78 bits.
_ALPHABET = "23456789abcdefghjkmnpqrstuvwxyz"
_LENGTH = 16
_LEAST_LENGTH = 12
_MAX_FILE = 4096


class TokenError(Exception):
    """No token is available, in one sentence."""


class Token:
    """The secret in a file, which is created if it is missing."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._secret = _read(path) or _make(path)

    def is_shown_by(self, authorization: str | None) -> bool:
        """True if an Authorization header holds it ("Bearer TOKEN")."""
        kind, _, shown = (authorization or "").partition(" ")
        is_right = hmac.compare_digest(shown.strip().encode(errors="replace"), self._secret)
        return kind.lower() == "bearer" and is_right


def _read(path: Path) -> bytes | None:
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise TokenError(f"{path} is not a file: name another token_file")
        if status.st_mode & 0o007:
            raise TokenError(f"other users can read the token in {path}: chmod 600 {path}")
        secret = read_bounded(path, _MAX_FILE).strip()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise TokenError(f"the token in {path} cannot be read: {reason(error)}") from error
    if len(secret) < _LEAST_LENGTH:
        raise TokenError(
            f"the token in {path} is shorter than {_LEAST_LENGTH} characters: delete the file for a new one"
        )
    return secret


def new_token() -> str:
    return "".join(secrets.choice(_ALPHABET) for _ in range(_LENGTH))


def _make(path: Path) -> bytes:
    secret = new_token().encode()
    try:
        replace_file(path, secret + b"\n")
    except OSError as error:
        raise TokenError(f"a token cannot be written to {path}: {reason(error)}") from error
    return secret

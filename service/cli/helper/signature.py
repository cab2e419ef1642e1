# SPDX-License-Identifier: GPL-3.0-or-later
"""The signature of a package: the last member, which dpkg ignores, by ssh-keygen over all bytes before it."""

import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from service.cli.helper.action import HelperRefusal

#: In the installed package: the keys of its releases (ssh-keygen's ALLOWED SIGNERS).
SIGNERS = "/usr/lib/naze-bridge/signers"
NAMESPACE = "naze-bridge-package"
_SIGNER = "naze-bridge"
#: A name that dpkg leaves to others, in the header of ar(5).
_NAME = b"_naze-bridge-sig"
_HEADER = b"%-16b%-12d%-6d%-6d%-8o%-10d`\n"
_HEADER_SIZE = 60
#: A signature has 300 bytes with an Ed25519 key, and up to 3 kB with an RSA key.
_MOST = 1 << 14
_TIMEOUT_S = 120


def add_signature(package: Path, signature: bytes) -> None:
    """Append the signature of a package."""
    with package.open("ab") as file:
        file.write(_HEADER % (_NAME, 0, 0, 0, 0o100644, len(signature)) + signature + b"\n" * (len(signature) % 2))


def has_key(signers: str) -> bool:
    """True if a text of allowed signers has a key."""
    return any(line and not line.startswith("#") for line in signers.splitlines())


def is_signed(package: Path) -> bool:
    return _NAME in _tail(package)


def _tail(package: Path) -> bytes:
    with package.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - _MOST))
        return file.read()


def check_signature(package: Path, signers: Path) -> None:
    """Check the signature of a package, and remove it. Raises HelperRefusal if it is missing, or of an unknown key.

    What is left is exactly what was signed. Only then is the package read.
    """
    tail = _tail(package)
    start = tail.rfind(_NAME)
    if start < 0:
        raise HelperRefusal("This package is not signed: take it from the releases of naze-bridge.")
    with package.open("r+b", buffering=0) as file, TemporaryDirectory() as folder:
        signature = Path(folder, "sig")
        signature.write_bytes(tail[start + _HEADER_SIZE :])
        file.truncate(package.stat().st_size - len(tail) + start)
        named = ("-I", _SIGNER, "-n", NAMESPACE, "-f", str(signers), "-s", str(signature))
        try:
            command = ("ssh-keygen", "-Y", "verify", *named)
            done = subprocess.run(command, stdin=file, capture_output=True, check=False, timeout=_TIMEOUT_S)  # noqa: S603  # our own words
        except FileNotFoundError:
            raise HelperRefusal("ssh-keygen is missing: sudo apt install openssh-client") from None
        except subprocess.TimeoutExpired:
            raise HelperRefusal("The signature could not be checked in time: send the package again.") from None
    if done.returncode:
        raise HelperRefusal(
            "The signature of this package is wrong: it was changed, or is not from naze-bridge's releases."
        )

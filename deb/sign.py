# SPDX-License-Identifier: GPL-3.0-or-later
"""Signs packages with the maintainer's SSH key, so that the status page of a Pi accepts them as updates.

`python -m deb.sign dist/*.deb` signs packages of `make deb` with git's user.signingkey. `make release` does it itself.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from service.cli.helper.action import HelperRefusal
from service.cli.helper.signature import NAMESPACE, add_signature, check_signature

PROJECT = Path(__file__).resolve().parent.parent
#: The public keys of the releases, which go into each package.
SIGNERS = PROJECT / "deb" / "signers"


class ReleaseError(Exception):
    """A reason not to release or sign; one sentence."""


def sign(file: Path, namespace: str = NAMESPACE) -> Path:
    """Sign a file with git's user.signingkey, an SSH key. Returns the signature's file, next to it."""
    key = _git_setting("user.signingkey")
    if not key or _git_setting("gpg.format") != "ssh":
        raise ReleaseError("there is no SSH key to sign with (CONTRIBUTING.md, A release)")
    signature = file.with_name(f"{file.name}.sig")
    signature.unlink(missing_ok=True)  # ssh-keygen would ask
    command = ("ssh-keygen", "-q", "-Y", "sign", "-n", namespace, "-f", str(Path(key).expanduser()), str(file))
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ReleaseError(f"ssh-keygen could not sign {file.name}: {done.stderr.strip()}")
    return signature


def sign_package(package: Path) -> None:
    """Add the signature to a package."""
    signature = sign(package)
    add_signature(package, signature.read_bytes())
    signature.unlink()


def check_key() -> None:
    """Make sure that a Pi will accept what is signed here. Raises ReleaseError if not."""
    with TemporaryDirectory() as folder:
        probe = Path(folder, "probe")
        probe.write_bytes(b"")
        sign_package(probe)
        try:
            check_signature(probe, SIGNERS)
        except HelperRefusal:
            raise ReleaseError(
                "git's user.signingkey is not one of deb/signers, so no Pi would accept the packages"
            ) from None


def _git_setting(name: str) -> str:
    command = ("git", "-C", str(PROJECT), "config", "--get", name)
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


if __name__ == "__main__":
    try:
        check_key()
        for package in sys.argv[1:]:
            sign_package(Path(package))
    except ReleaseError as error:
        sys.exit(f"not signed: {error}")

# SPDX-License-Identifier: GPL-3.0-or-later
"""An SSH key that signs packages, as the maintainer's does."""

import subprocess
from pathlib import Path

from service.cli.helper.signature import NAMESPACE, add_signature


class ReleaseKey:
    """`file`: the private key; `signers`: the file that goes into packages."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        self.file = folder / "key"
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", self.file], check=True)
        self.signers = folder / "signers"
        public = self.file.with_suffix(".pub").read_text()
        self.signers.write_text(f'naze-bridge namespaces="{NAMESPACE},file" {public}')

    def signature(self, package: Path, namespace: str = NAMESPACE) -> bytes:
        command = ["ssh-keygen", "-q", "-Y", "sign", "-n", namespace, "-f", str(self.file)]
        return subprocess.run(command, input=package.read_bytes(), capture_output=True, check=True).stdout

    def sign(self, package: Path) -> Path:
        add_signature(package, self.signature(package))
        return package

# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes certificates for a fleet: `python make_certificates.py FOLDER ROUTER_HOST[,HOST...] NAME...`.

Needs `pip install trustme`. Makes in FOLDER: ca.pem, for every member, and ca.key, which stays here; router.pem and
router.key for the router, which is reached as ROUTER_HOST (a name or an address); NAME.pem and NAME.key for each
vehicle and each person. To add names, run it again with the same FOLDER: existing files are kept.

A member's certificate names no host, so it cannot pass for the router's.
"""

import sys
from pathlib import Path

import trustme

#: A certificate needs an identity that is not a host's.
_MEMBER = "member@fleet.invalid"


def main(folder: Path, hosts: list[str], names: list[str]) -> None:
    for name in names:
        if name.lower() in ("ca", "router") or "/" in name or name.startswith(".") or not name.isprintable():
            sys.exit(f"{name!a} cannot be a member's name: NAME.pem and NAME.key are its files in {folder}")
    folder.mkdir(parents=True, exist_ok=True)
    authority = _authority(folder)
    _issue(authority, folder, "router", hosts)
    for name in names:
        _issue(authority, folder, name, [_MEMBER])


def _authority(folder: Path) -> trustme.CA:
    certificate, key = folder / "ca.pem", folder / "ca.key"
    if key.exists():
        return trustme.CA.from_pem(certificate.read_bytes(), key.read_bytes())
    authority = trustme.CA(organization_name="naze-bridge fleet")
    authority.cert_pem.write_to_path(str(certificate))
    _write_secret(key, authority.private_key_pem.bytes())
    return authority


def _issue(authority: trustme.CA, folder: Path, name: str, hosts: list[str]) -> None:
    if (folder / f"{name}.key").exists():
        return
    issued = authority.issue_cert(*hosts, common_name=name)
    (folder / f"{name}.pem").write_bytes(b"".join(pem.bytes() for pem in issued.cert_chain_pems))
    _write_secret(folder / f"{name}.key", issued.private_key_pem.bytes())


def _write_secret(path: Path, data: bytes) -> None:
    path.touch(mode=0o600)
    path.write_bytes(data)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), sys.argv[2].split(","), sys.argv[3:])

# SPDX-License-Identifier: GPL-3.0-or-later
"""Write permission per ground station link: the table form of a `gcs` setting.

gcs = [
    "udpin:127.0.0.1:14551",
    {address = "udpin:0.0.0.0:14550", key_file = "/etc/naze-bridge/gcs.key", writers = ["192.168.4.0/24"]},
]
"""

import os
import stat
from dataclasses import dataclass, field, replace
from ipaddress import IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from pathlib import Path

from bridge.gcs.station import Peer
from protocols.mavlink.signing import key_from_passphrase
from protocols.remedies import Fault
from service.settings.addresses import AddressError, GcsAddress, parse_gcs, parse_table
from service.settings.passphrase import weakness
from storage.os_error import reason
from storage.small_files import open_regular

Network = IPv4Network | IPv6Network

_MAX_PASSPHRASE = 4096


@dataclass(frozen=True, slots=True)
class WriteAccess:
    """`key` None if signatures are not required. `writers` None: any address may write, or none if it is empty.

    `weak_key`: a sentence if the key can be guessed.
    """

    key: bytes | None = field(default=None, repr=False)
    writers: tuple[Network, ...] | None = None
    weak_key: str | None = None

    @property
    def is_open(self) -> bool:
        return self.key is None and self.writers is None

    def with_key(self, other: "WriteAccess") -> "WriteAccess":
        """These rules, with the other's key if they have none."""
        return self if self.key is not None else replace(other, writers=self.writers)

    def has_address(self, peer: Peer) -> bool:
        assert self.writers is not None
        assert isinstance(peer.key, tuple)
        address = ip_address(peer.key[0])
        if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
            # A dual-stack socket shows an IPv4 peer like this.
            address = address.ipv4_mapped
        return any(address in network for network in self.writers)


def parse_link(entry: object, folder: Path) -> tuple[GcsAddress, WriteAccess]:
    """Read one entry of `gcs`: a connection string or a table. A relative `key_file` is looked for in `folder`."""
    if isinstance(entry, str):
        return parse_gcs(entry), WriteAccess()
    address, table = parse_table(entry, "gcs", "udpin:0.0.0.0:14550", ["key_file", "writers"])
    key_file, writers = table.get("key_file"), table.get("writers")
    if writers is not None and address.is_serial:
        raise AddressError(f"gcs {address}: writers lists networks, and a radio does not have any: use key_file")
    if key_file is not None and (not isinstance(key_file, str) or not key_file):
        raise AddressError(f"gcs {address}: key_file must be the name of a file that holds the passphrase")
    if writers is not None and not isinstance(writers, list):
        raise AddressError(f'gcs {address}: writers must be a list of networks like ["192.168.4.0/24"]')
    networks = None if writers is None else tuple(_network(address, writer) for writer in writers)
    if key_file is None:
        return address, WriteAccess(writers=networks)
    return address, replace(signing_access(folder / key_file), writers=networks)


def signing_access(path: Path) -> WriteAccess:
    """Access with the key whose passphrase is in a file. Raises AddressError if it cannot be used."""
    passphrase = read_passphrase(path)
    weak = weakness(passphrase)
    return WriteAccess(key_from_passphrase(passphrase), weak_key=None if weak is None else f"the key in {path} {weak}")


def read_passphrase(path: Path) -> str:
    """The only line of a file that other users cannot read."""
    try:
        with open_regular(path) as file:
            if os.fstat(file.fileno()).st_mode & stat.S_IRWXO:
                raise AddressError(Fault.KEY_FILE_OPEN.text(path=path))
            passphrase = file.read(_MAX_PASSPHRASE + 1).decode()
    except OSError as error:
        raise AddressError(f"key_file {path} cannot be read: {reason(error)}") from error
    except UnicodeDecodeError:
        # Not "from" the error, which quotes the passphrase.
        raise AddressError(Fault.KEY_FILE_LINES.text(path=path)) from None
    passphrase = passphrase.removesuffix("\n").removesuffix("\r")
    if not passphrase or "\n" in passphrase or len(passphrase) > _MAX_PASSPHRASE:
        raise AddressError(Fault.KEY_FILE_LINES.text(path=path))
    return passphrase


def _network(address: GcsAddress, text: object) -> Network:
    try:
        return ip_network(str(text))
    except ValueError as error:
        raise AddressError(f"gcs {address}: writers: {error}; write 192.168.4.0/24 or 192.168.4.7") from error

# SPDX-License-Identifier: GPL-3.0-or-later
"""The description in a Debian package, read on any system: an ar archive of tar archives (deb(5))."""

import tarfile
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

from protocols.plain_text import plain_text
from storage.os_error import reason
from storage.small_files import open_regular

_MAGIC = b"!<arch>\n"
_HEADER_SIZE, _SIZE = 60, slice(48, 58)
_MOST_CONTROL = 1 << 20


class PackageFile(NamedTuple):
    """The fields as in the control file."""

    name: str
    version: str
    architecture: str


def read_package(path: Path) -> PackageFile:
    """Read a package's description; ValueError, one sentence, if it is damaged or no package."""
    try:
        lines = map(plain_text, _control(path).splitlines())
        fields = dict(line.split(": ", 1) for line in lines if ": " in line)
        return PackageFile(fields["Package"], fields["Version"], fields["Architecture"])
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {reason(error)}") from error
    except (ValueError, KeyError, EOFError, tarfile.TarError):
        raise ValueError(f"{path} is not a Debian package (.deb), or it is damaged: fetch it again") from None


def _control(path: Path) -> bytes:
    """The control file; reads to the end of the package, which a download may lack."""
    with open_regular(path) as file:
        size = path.stat().st_size
        if file.read(len(_MAGIC)) != _MAGIC:
            raise ValueError
        control = b""
        while header := file.read(_HEADER_SIZE):
            length = int(header[_SIZE])
            if header.startswith(b"control.tar") and length <= _MOST_CONTROL:
                with tarfile.open(fileobj=BytesIO(file.read(length))) as archive:
                    (member,) = (each for each in archive if each.name in ("control", "./control"))
                    found = archive.extractfile(member)
                    control = b"" if found is None else found.read(_MOST_CONTROL)
                file.seek(length % 2, 1)
            else:
                file.seek(length + length % 2, 1)
        if file.tell() > size:
            raise ValueError
        return control

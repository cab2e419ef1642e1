# SPDX-License-Identifier: GPL-3.0-or-later
"""The start and the end of the program `naze-bridge`, as the shell sees them."""

import io
import os
import signal
import sys


def start() -> None:
    """Import and run the command. Ctrl-C during the import or the exit ends the process silently, as by default."""
    _open_standard_streams()
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # else ignored: a background job
    if is_usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from service.cli.main import main  # up to a second on a Pi

    if is_usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        sys.exit(main(prog_name="naze-bridge"))
    finally:
        if is_usual:
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _open_standard_streams() -> None:
    """Replace closed streams (`>&-`) by /dev/null: a serial port must not become descriptor 1 or 2.

    A letter that the terminal's encoding lacks, as in a file's name, is printed as a question mark.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free number: this one
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")

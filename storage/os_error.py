# SPDX-License-Identifier: GPL-3.0-or-later
"""The reason of a failed system call, for a sentence."""

import os


def reason(error: Exception) -> str:
    """The system's message. asyncio's errors have a longer one. getaddrinfo's have numbers below 0.

    A termios.error has only arguments, its number and the message.
    """
    if isinstance(error, OSError):
        return os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror or str(error)
    return str(error.args[-1] if error.args else error)

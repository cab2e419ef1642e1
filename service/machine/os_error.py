# SPDX-License-Identifier: GPL-3.0-or-later
"""The reason of a failed system call, for a sentence."""

import os


def reason(error: OSError) -> str:
    """The system's message. asyncio's errors have a longer one; getaddrinfo's have numbers below 0."""
    return os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror or str(error)

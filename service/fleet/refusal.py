# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a router that answers does not let us in: the wrong login, or no session left.

zenoh tells the reason to its log alone, so a program of its own tries once more and its log is read.
"""

import subprocess
import sys

import zenoh

_TRY = "import sys, zenoh; zenoh.init_log_from_env_or('error'); zenoh.open(zenoh.Config.from_json5(sys.stdin.read()))"
_TIMEOUT_S = 6.0
#: What zenoh 1.10 logs at either end of a refused handshake.
_REASONS = {
    "reason INVALID": "the router takes no more sessions: raise transport/unicast/max_sessions in its configuration",
    "reason GENERIC": "the router does not accept this user and password",
    "in response to an InitSyn": "the router wants a user and a password: give them in --zenoh-config",
}


def refusal(config: zenoh.Config) -> str | None:
    """The router's reason, in one line; None if it gave none. Blocks for some seconds at worst."""
    try:
        tried = subprocess.run(  # noqa: S603  # this Python, and nothing of the user's in its arguments
            [sys.executable, "-c", _TRY],
            input=str(config),
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
    except (subprocess.TimeoutExpired, OSError):
        return None
    return next((said for sign, said in _REASONS.items() if sign in tried.stdout), None)

# SPDX-License-Identifier: GPL-3.0-or-later
"""The reason why a reachable router rejects the session: a wrong login, or no session left.

zenoh only logs the reason, so a separate program tries again and its log is read.
"""

import subprocess
import sys

import zenoh

_TRY = "import sys, zenoh; zenoh.init_log_from_env_or('error'); zenoh.open(zenoh.Config.from_json5(sys.stdin.read()))"
_TIMEOUT_S = 6.0
#: The log messages of zenoh 1.10 on either side of a rejected handshake.
_REASONS = {
    "reason INVALID": "the router accepts no more sessions: raise transport/unicast/max_sessions in its configuration",
    "reason GENERIC": "the router does not accept this user and password",
    "in response to an InitSyn": "the router requires a user and a password: give them in --zenoh-config",
}


def refusal(config: zenoh.Config) -> str | None:
    """The router's reason, in one line; None if it gave none. Blocks for some seconds."""
    try:
        tried = subprocess.run(  # noqa: S603  # this Python, without any user input
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

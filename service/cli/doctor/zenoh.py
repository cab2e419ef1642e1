# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of zenoh: the configuration, and the connection to the routers."""

from typing import Any

from payloads.names import ZenohSettingsError
from service.cli.doctor.checked import Checked, note, ok, problem
from service.settings.zenoh import ZenohSettings

_CONNECT_TIMEOUT_MS = 2000


def check_zenoh(settings: ZenohSettings | None) -> Checked:
    """Check the configuration, and try to connect to its endpoints."""
    if settings is None:
        return ok("zenoh", "off")
    # Importing zenoh takes half a second.
    from payloads.endpoints import connect_endpoints, endpoint_trouble, tls_files
    from service.settings.zenoh_config import make_config

    try:
        config = make_config(settings)
    except ZenohSettingsError as error:
        return problem("zenoh", str(error), "correct the [zenoh] table or its config_file")
    me = f"{settings.prefix}/{settings.vehicle}"
    endpoints = connect_endpoints(config)
    if not endpoints:
        return ok("zenoh", f"{me}, opens no connections")
    if _joins(config):
        return ok("zenoh", f"{me}, accepted by {', '.join(endpoints)}")
    trouble = endpoint_trouble(endpoints, tls_files(config))
    return note("zenoh", f"{me}: {trouble}", "start the router there, or correct zenoh.connect")


def _joins(config: Any) -> bool:
    """True if a router accepts the session: a client that does not listen, so that it does not disturb a daemon."""
    import zenoh

    config.insert_json5("mode", '"client"')
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("connect/timeout_ms", str(_CONNECT_TIMEOUT_MS))
    try:
        zenoh.open(config).close()  # type: ignore[no-untyped-call]
    except zenoh.ZError:
        return False
    return True

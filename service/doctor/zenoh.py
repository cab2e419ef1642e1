# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of zenoh: does its configuration hold, and do its routers answer."""

from typing import Any

from service.doctor.checked import Checked, note, ok, problem
from service.zenoh_link.settings import ZenohSettings, ZenohSettingsError

_PATIENCE_MS = 2000


def check_zenoh(settings: ZenohSettings | None) -> Checked:
    """Look at the configuration as the daemon will, and knock at the endpoints that it connects to."""
    if settings is None:
        return ok("zenoh", "off")
    # zenoh costs half a second to load.
    from service.zenoh_link.configuration import connect_endpoints, make_config, tls_files
    from service.zenoh_link.endpoint_trouble import endpoint_trouble

    try:
        config = make_config(settings)
    except ZenohSettingsError as error:
        return problem("zenoh", str(error), "correct the [zenoh] table or its config_file")
    me = f"{settings.prefix}/{settings.vehicle}"
    endpoints = connect_endpoints(config)
    if not endpoints:
        return ok("zenoh", f"{me}, connects to nobody by itself")
    if _joins(config):
        return ok("zenoh", f"{me}, let in by {', '.join(endpoints)}")
    trouble = endpoint_trouble(endpoints, tls_files(config))
    return note("zenoh", f"{me}: {trouble}", "start the router there, or correct zenoh.connect")


def _joins(config: Any) -> bool:
    """Tell whether a router lets us in; as a client who listens nowhere, beside the daemon that may run."""
    import zenoh

    config.insert_json5("mode", '"client"')
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("connect/timeout_ms", str(_PATIENCE_MS))
    try:
        zenoh.open(config).close()  # type: ignore[no-untyped-call]
    except zenoh.ZError:
        return False
    return True

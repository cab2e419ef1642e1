# SPDX-License-Identifier: GPL-3.0-or-later
"""The zenoh session of `naze-bridge fleet`: a client of one router, or of one vehicle directly.

Not a peer, because peers that have only a router in common do not see each other.
"""

import json
import queue
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path

import zenoh

from fleet.payload import decode, part, text
from payloads.endpoints import connect_endpoints, endpoint_trouble, in_short, read_zenoh_file, tls_files
from payloads.keys import full
from payloads.mission_data import Json
from storage.os_error import reason

DEFAULT_ENDPOINT = "tcp/localhost:7447"
#: How many vehicles get a query at the same time: each such query may carry a mission file.
AT_ONCE = 50
#: For peers that do not speak zenoh. zenoh's own default is 10 s.
_OPEN_TIMEOUT_MS = 3000
#: A bridge's longest reply, a piece of a log, has 88 kB.
_MAX_MESSAGE_BYTES = 1 << 20


class FleetError(Exception):
    """A fleet command failed, in one sentence."""


def open_session(connect: Sequence[str] = (), config_file: Path | None = None) -> zenoh.Session:
    """Open the session. Raises FleetError if that fails. Of several endpoints the first to answer is used.

    `config_file`: a zenoh configuration to start from, for TLS, passwords and the like.
    """
    config = _config(connect, config_file)
    endpoints = connect_endpoints(config)
    if not endpoints:
        raise FleetError(f"{config_file} lacks connect/endpoints: add them, or use --connect")
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise FleetError(f"cannot join the fleet: {endpoint_trouble(endpoints, tls_files(config))}") from error


#: Why a vehicle does not reply to a command.
NO_COMMANDS = "accepts no commands: zenoh.commands is off there, access is denied, or it or the router disconnected"
NOT_UNDERSTOOD = "this version does not understand its reply"


def ask_each(
    session: zenoh.Session,
    prefix: str,
    names: Iterable[str],
    suffix: str,
    timeout_s: float,
    payload: bytes | None = None,
) -> Iterator[tuple[str, zenoh.Reply | None]]:
    """Query vehicles individually, some at a time, and yield the replies of each as they arrive, then None.

    Names are taken one by one, when there is room for another query.
    """
    replies: queue.SimpleQueue[tuple[str, zenoh.Reply | None]] = queue.SimpleQueue()

    def start(name: str) -> None:
        send_query(session, full(prefix, name, suffix), lambda reply: replies.put((name, reply)), timeout_s, payload)

    waiting, running = iter(names), 0
    while True:
        for name in islice(waiting, AT_ONCE - running):
            start(name)
            running += 1
        if not running:
            return
        name, reply = replies.get()
        running -= reply is None
        yield name, reply


def send_query(
    session: zenoh.Session,
    selector: str,
    replied: Callable[[zenoh.Reply | None], object],
    timeout_s: float,
    payload: bytes | None = None,
) -> None:
    """Send a query. `replied` is called on zenoh's threads: with each reply (vehicles may share a name), then None."""
    session.get(
        selector,
        # Direct: otherwise each query would have a thread.
        zenoh.handlers.Callback(replied, lambda: replied(None), indirect=False),
        target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE,
        payload=payload,
        timeout=timeout_s,
    )


def answer_of(reply: zenoh.Reply) -> tuple[Json | None, str | None]:
    """The result of a command, or why there is none."""
    answer = reply.ok or reply.err
    data = (answer and decode(answer)) or {}
    result = part(data, "result")
    if reply.ok is not None and isinstance(result, dict):
        return result, None
    return None, text(data, "error") or NOT_UNDERSTOOD


def is_connected(session: zenoh.Session) -> bool:
    """True if the router (or the one vehicle) is connected at this moment."""
    return bool(session.info.routers_zid() or session.info.peers_zid())


def _config(connect: Sequence[str], config_file: Path | None) -> zenoh.Config:
    config = zenoh.Config() if config_file is None else _from_file(config_file)
    endpoints = list(connect)
    if not endpoints and config_file is None:
        endpoints = [DEFAULT_ENDPOINT]
    settings: dict[str, object] = {
        "mode": "client",
        "listen/endpoints": [],
        "scouting/multicast/enabled": False,
        "transport/unicast/open_timeout": _OPEN_TIMEOUT_MS,
        "transport/link/rx/max_message_size": _MAX_MESSAGE_BYTES,
    }
    if endpoints:
        settings["connect/endpoints"] = endpoints
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
    except zenoh.ZError as error:
        raise FleetError(f"zenoh rejects --connect {' --connect '.join(endpoints)}: {in_short(error)}") from error
    return config


def _from_file(path: Path) -> zenoh.Config:
    try:
        return read_zenoh_file(path)
    except OSError as error:
        raise FleetError(f"{path} cannot be read: {reason(error)}") from error
    except zenoh.ZError as error:
        raise FleetError(f"{path} is not a zenoh configuration: {in_short(error)}") from error

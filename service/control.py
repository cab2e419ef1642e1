"""The daemon's local control socket: `push`, `pull`, `status` and their like talk to a running daemon through it.

A Unix socket in the state directory; one JSON object a line. A request has the key "do"; the daemon answers with
any number of {"progress": ...} lines and one last line with "result" or "error".
"""

import asyncio
import json
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import structlog

from bridge.mission_desk import Delivery, HeldMission, Refusal
from bridge.mission_log import ArrivedMission
from protocols.mission_item import MissionItem
from protocols.wp_record import pack_records
from service.daemon import Daemon
from service.store_worker import as_dicts
from storage.mission_store import StoreError

SOCKET_NAME = "control.sock"
_MAX_LINE = 1 << 20
_log = structlog.get_logger()

Json = dict[str, Any]


class ControlError(Exception):
    """The daemon refused, or is not there; one sentence."""


class MissionJobs:
    """What can be asked of a daemon, as coroutines with plain data."""

    def __init__(self, daemon: Daemon) -> None:
        self._daemon = daemon
        self._loop = asyncio.get_running_loop()

    async def do(self, request: Json, tell: Callable[[Json], None]) -> Json:
        """Do what a request asks for; `tell` takes the progress. ControlError or StoreError say why not."""
        match request["do"]:
            case "push":
                items = [MissionItem(**item) for item in request["items"]]
                return await self.push(items, str(request["source"]), tell)
            case "pull":
                return await self.pull()
            case "status":
                return self.status()
            case "missions":
                return await self.list_missions(int(request["limit"]))
            case "mission":
                return await self.show_mission(int(request["number"]))
            case "restore":
                return await self.restore(int(request["number"]), tell)
            case other:
                raise ControlError(f"{other!r} is no request")

    async def push(self, items: list[MissionItem], source: str, progress: Callable[[Json], None]) -> Json:
        """Check, push and verify a list; no items clear what is there."""
        future: asyncio.Future[Json] = self._loop.create_future()

        def done(outcome: Delivery | Refusal, arrived: ArrivedMission | None) -> None:
            answer: Json = {"ack": f"MAV_MISSION_{outcome.ack.name}", "text": outcome.text}
            if arrived is not None:
                answer |= {
                    "verdict": arrived.verdict.result.name,
                    "sent": as_dicts(arrived.items),
                    "stored": as_dicts(arrived.verdict.items),
                    "findings": as_dicts(arrived.verdict.findings),
                    "mission": outcome.number if isinstance(outcome, Delivery) else None,
                }
            future.set_result(answer)

        bridge = self._daemon.bridge
        bridge.push_locally(items, source, lambda records: progress({"progress": records}), done, self._loop.time())
        self._daemon.flush()
        return await future

    async def pull(self) -> Json:
        """Read what the flight controller holds."""
        future: asyncio.Future[HeldMission | Refusal] = self._loop.create_future()
        self._daemon.bridge.pull_locally(future.set_result, self._loop.time())
        self._daemon.flush()
        held = await future
        if isinstance(held, Refusal):
            raise ControlError(held.text)
        return {
            "count": held.identity.count,
            "checksum": f"{held.identity.checksum:08x}",
            "items": as_dicts(held.items),
            "records": [pack_records([record]).hex() for record in held.records],
        }

    def status(self) -> Json:
        """Tell how the bridge stands."""
        bridge = self._daemon.bridge
        session = bridge.session
        controller = session.controller
        vehicle = session.vehicle
        held = bridge.desk.held
        link = session.link
        return {
            "flight_controller": None if controller is None else controller.name,
            "state": session.state.value,
            "speed_baud": session.speed if controller else None,
            "armed": vehicle.armed,
            "battery_v": vehicle.analog.battery_dv / 10 if vehicle.analog else None,
            "satellites": vehicle.gps.satellites if vehicle.gps else None,
            "ground_stations": [str(peer) for peer in bridge.ground.peers()],
            "mission_records": None if held is None else held.identity.count,
            "mission_checksum": None if held is None else f"{held.identity.checksum:08x}",
            "round_trip_ms": None if link is None else round(link.round_trip_s * 1000, 1),
            "requests_lost": None if link is None else link.requests_lost,
            "bad_checksums": None if link is None else link.bad_checksums,
        }

    async def list_missions(self, limit: int) -> Json:
        """List what came in, newest first."""
        missions = await self._daemon.store.ask(lambda store: store.list(limit))
        return {"missions": [asdict(mission) for mission in missions]}

    async def show_mission(self, number: int) -> Json:
        """Return one mission with all that is known of it."""
        mission = await self._daemon.store.ask(lambda store: store.get(number))
        if mission is None:
            raise ControlError(f"there is no mission {number}; `naze-bridge missions list` shows which there are")
        data = asdict(mission)
        data["received"]["records"] = mission.received.records.hex()
        return data

    async def restore(self, number: int, progress: Callable[[Json], None]) -> Json:
        """Push a stored mission again, as it was sent then: the rules of today apply."""
        data = await self.show_mission(number)
        items = [MissionItem(**item) for item in data["received"]["items"]]
        return await self.push(items, f"restore of mission {number}", progress)


class ControlServer:
    """Serves the socket."""

    def __init__(self, daemon: Daemon, path: Path) -> None:
        self._jobs = MissionJobs(daemon)
        self._path = path
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        """Listen. A socket that a killed daemon left behind is replaced: the state lock says that it is dead."""
        self._path.unlink(missing_ok=True)
        self._server = await asyncio.start_unix_server(self._serve, self._path, limit=_MAX_LINE)
        self._path.chmod(0o660)

    def close(self) -> None:
        """Stop listening."""
        if self._server is not None:
            self._server.close()
        self._path.unlink(missing_ok=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def tell(answer: Json) -> None:
            writer.write(json.dumps(answer).encode() + b"\n")

        try:
            line = await reader.readline()
            tell({"result": await self._jobs.do(json.loads(line), tell)})
            await writer.drain()
        except (ControlError, StoreError) as error:
            tell({"error": str(error)})
        except (ValueError, KeyError, TypeError) as error:
            _log.debug("control.bad_request", why=str(error))
            tell({"error": f"request not understood: {error}"})
        except ConnectionError:
            pass
        finally:
            with suppress(ConnectionError):
                writer.close()
                await writer.wait_closed()


def ask_daemon(state_dir: Path, request: Json, progress: Callable[[int], None] = lambda _: None) -> Json:
    """Ask the daemon that runs on `state_dir`; ControlError if there is none or it refuses."""
    path = state_dir / SOCKET_NAME
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        try:
            connection.connect(str(path))
        except OSError as error:
            raise ControlError(
                f"no daemon answers on {path}: start one with `naze-bridge run`, or use --fc directly"
            ) from error
        connection.sendall(json.dumps(request).encode() + b"\n")
        for answer in _lines(connection):
            if "progress" in answer:
                progress(answer["progress"])
            elif "error" in answer:
                raise ControlError(answer["error"])
            else:
                result: Json = answer["result"]
                return result
    raise ControlError("the daemon ended before it answered")


def _lines(connection: socket.socket) -> Iterator[Json]:
    with connection.makefile() as stream:
        for line in stream:
            yield json.loads(line)

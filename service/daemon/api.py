# SPDX-License-Identifier: GPL-3.0-or-later
"""The requests to a running daemon: the control socket, the page and zenoh answer through them."""

import asyncio
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import TypeVar

from bridge.missions.mission_service import DeliveryResult, HeldMission
from bridge.model.missions import ArrivedMission, Refusal
from payloads.mission_data import MAX_ITEMS, MOST, Json, mission_items, plain, verdict_data, whole_number
from protocols.mission_item import MissionItem, pack_records
from service.daemon.client import FIRMWARE_REQUESTS, ControlError
from service.daemon.daemon import Daemon
from service.daemon.firmware_api import FirmwareApi
from service.daemon.settings_api import SETTINGS_REQUESTS, SettingsApi
from service.machine.package import version
from storage.mission_store import MissionStore, MissionSummary, ReceivedMission, StoredMission

#: The source of a pushed list, as shown to every ground station.
_MAX_SOURCE = 100
#: Missions in one reply: a thousand are 300 kB.
_MOST_LISTED = 1000
SIGNING_RESET = "Signing times forgotten: the next ground station with the key sets the time"
T = TypeVar("T")


class DaemonApi:
    """The requests to a daemon, as coroutines with plain data.

    `state_dir`: for backups of firmware, if the daemon itself has none.
    """

    def __init__(self, daemon: Daemon, state_dir: Path | None = None) -> None:
        self._daemon = daemon
        self._loop = asyncio.get_running_loop()
        self.settings = SettingsApi(daemon)
        self.firmware = FirmwareApi(daemon, self.settings, daemon.settings.state_dir or state_dir)

    async def do(self, request: Json, progress: Callable[[Json], None]) -> Json:
        """Handle a request. `progress` is called with each step. ControlError, StoreError or ValueError on failure."""
        match request.get("do"):
            case "push":
                source = str(request.get("source"))[:_MAX_SOURCE]
                may_erase = request.get("may_erase") is not False
                items = request.get("items")
                if isinstance(items, list) and len(items) > MAX_ITEMS:
                    raise ControlError(f"this mission is longer than any flight controller stores: {len(items)} items")
                return await self.push(mission_items(items), source, progress, may_erase=may_erase)
            case "pull":
                return await self.pull()
            case "status":
                return self.status()
            case "reset-signing":
                self._daemon.reset_signing()
                return {"text": SIGNING_RESET}
            case "missions":
                return await self.list_missions(whole_number(request, "limit", 1, MOST))
            case "mission":
                return await self.show_mission(whole_number(request, "number", 0, MOST))
            case "restore":
                return await self.restore(whole_number(request, "number", 0, MOST), progress)
            case str(name) if name in SETTINGS_REQUESTS:
                return await self.settings.do(request, progress)
            case str(name) if name in FIRMWARE_REQUESTS:
                return await self.firmware.do(request, progress)
            case other:
                raise ControlError(f"{str(other)[:_MAX_SOURCE]!r} is not a request")

    async def push(
        self, items: list[MissionItem], source: str, progress: Callable[[Json], None], *, may_erase: bool = True
    ) -> Json:
        """Check, push and verify a list. An empty one clears the mission. `may_erase`: see LocalMissions.push."""

        def written(records: int) -> None:
            progress({"progress": records})

        def start(done: Callable[[Json], None], now: float) -> None:
            def ended(outcome: DeliveryResult | Refusal, arrived: ArrivedMission | None) -> None:
                done(delivery_data(outcome, arrived))

            self._daemon.bridge.missions.push(items, source, written, ended, now, may_erase=may_erase)

        return await self._daemon.answer(start)

    async def check(self, items: list[MissionItem]) -> Json:
        check = self._daemon.bridge.missions.check
        return verdict_data(await self._answer(lambda answered, now: check(items, answered, now)))

    async def pull(self) -> Json:
        held = await self._answer(self._daemon.bridge.missions.pull)
        return _held(held) | {"others": [_held(other) for other in self._daemon.bridge.missions.others]}

    async def _answer(self, start: Callable[[Callable[[T | Refusal], None], float], None]) -> T:
        """Wait for an operation's result. Raises ControlError if it is refused."""
        result = await self._daemon.answer(start)
        if isinstance(result, Refusal):
            raise ControlError(result.text)
        return result

    def status(self) -> Json:
        daemon = self._daemon
        web, report, counters = daemon.settings.web, daemon.report(), daemon.bridge.counters()
        settings = counters.settings
        change = None if settings is None else settings.change
        link, mission, firmware = report.link, report.mission, counters.firmware_version
        return {
            "version": version(),
            "uptime_s": round(self._loop.time() - daemon.started_at, 1),
            "where": daemon.fc.where,
            "trouble": daemon.fc.trouble,
            "found_s": None if daemon.fc.found_at is None else round(self._loop.time() - daemon.fc.found_at, 1),
            "links": [str(address) for address in daemon.settings.gcs],
            "page": None if web is None else str(web.listen),
            "page_trouble": daemon.page_trouble,
            "mode": report.status.mode,
            "fix": report.gps.fix,
            "flight_controller": link.flight_controller,
            "firmware_version": None if firmware is None else ".".join(map(str, firmware)),
            "state": link.state,
            "speed_baud": link.speed_baud,
            "armed": report.status.armed,
            "status_age_s": report.status.age_s,
            "battery_v": report.battery.voltage_v,
            "battery_age_s": report.battery.age_s,
            "satellites": report.gps.satellites,
            "gps_age_s": report.gps.age_s,
            "ground_stations": list(link.ground_stations),
            "refused": [
                *(f"{count} x {why} ({link})" for (link, why), count in counters.refused.items()),
                *(f"{count} x {why} (share)" for why, count in counters.refused_by_share.items()),
            ],
            "recording": daemon.recording,
            "store_trouble": daemon.store_trouble,
            "clock_trouble": daemon.clock_trouble,
            "mission_records": None if mission is None else mission.count,
            "mission_checksum": None if mission is None else mission.checksum,
            "mission_state": None if mission is None else mission.state,
            "mission_item": None if mission is None else mission.item,
            "declination": counters.declination,
            "settings_seal": None if settings is None else str(settings.seal),
            "settings_changed": None if change is None else change.text,
            "settings_changed_s": None if change is None else round(self._loop.time() - change.at, 1),
            "round_trip_ms": link.round_trip_ms,
            "requests_lost": link.requests_lost,
            "bad_checksums": link.bad_checksums,
            "fc_bytes_received": daemon.traffic["fc"].bytes_received,
            **daemon.fc.ports(),
            **daemon.followers_status(),
        }

    async def list_missions(self, limit: int) -> Json:
        def listed(store: MissionStore) -> list[Json]:
            missions = store.list(min(limit, _MOST_LISTED))
            return [_fields(mission) | {"checksum": _hex(mission.checksum)} for mission in missions]

        return {"missions": await self._daemon.store.ask(listed)}

    async def show_mission(self, number: int) -> Json:
        """One mission. Raises ControlError if there is none of that number."""
        mission = await self._daemon.store.ask(lambda store: store.get(number))
        if mission is None:
            raise ControlError(f"there is no mission {number}; `naze-bridge missions list` shows the numbers")
        received = mission.received
        as_text = {"records": received.records.hex(), "checksum": _hex(received.checksum)}
        return _fields(mission) | {"received": _fields(received) | as_text}

    async def restore(self, number: int, progress: Callable[[Json], None]) -> Json:
        """Push a stored mission again, as it was sent. The current rules apply."""
        data = await self.show_mission(number)
        return await self.push(mission_items(data["received"]["items"]), f"restore of mission {number}", progress)


def delivery_data(outcome: DeliveryResult | Refusal, arrived: ArrivedMission | None) -> Json:
    """The result of a mission, with the lists as sent and as stored if it was checked."""
    answer: Json = {"ack": f"MAV_MISSION_{outcome.ack.name}", "text": outcome.text}
    if arrived is not None:
        answer |= {
            "verdict": arrived.verdict.result.name,
            "sent": list(map(plain, arrived.items)),
            "stored": list(map(plain, arrived.verdict.items)),
            "sent_seqs": list(arrived.verdict.sent_seqs),
            "findings": list(map(plain, arrived.verdict.findings)),
            "mission": outcome.number if isinstance(outcome, DeliveryResult) else None,
        }
    return answer


def _fields(thing: MissionSummary | StoredMission | ReceivedMission) -> Json:
    """The fields by name. Unlike asdict() it does not copy: for 146 items that would take 8 ms of the loop."""
    return {field.name: getattr(thing, field.name) for field in fields(thing)}


def _held(held: HeldMission) -> Json:
    return {
        "count": held.identity.count,
        "checksum": _hex(held.identity.checksum),
        "items": list(map(plain, held.items)),
        "records": [pack_records([record]).hex() for record in held.records],
    }


def _hex(checksum: int) -> str:
    return f"{checksum:08x}"

# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions on the status page: listed, compared, and restored under the same rules as elsewhere."""

from concurrent.futures import ThreadPoolExecutor

from payloads.names import host_name
from tests.support.benches import Starter
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import WebBench, web_daemon

pytest_plugins = ("tests.support.web_fixtures",)


def test_the_list_on_the_flight_controller_is_shown(shared_web: WebBench) -> None:
    held = shared_web.ask("/api/held").data
    assert held["count"] == len(held["items"]) == 13
    assert held["checksum"] == shared_web.state()["mission"]["checksum"] == shared_web.daemon.pull()["checksum"]
    assert [item["name"] for item in held["items"][:4]] == ["WAYPOINT", "TAKEOFF", "WAYPOINT", "DO_SET_ROI"]


def test_the_state_has_link_vehicle_and_traffic(shared_web: WebBench) -> None:
    state = until(lambda: (now := shared_web.state())["gps"]["satellites"] and now, "telemetry")
    assert (state["link"]["state"], state["link"]["speed_baud"]) == ("MSP", 115200)
    assert (state["status"]["armed"], state["status"]["mode"]) == (False, "STABILIZE")
    assert state["newest_mission"] == {"number": 1, "outcome": "VERIFIED"}
    received = state["traffic"]["fc"]["bytes_received"]
    until(lambda: shared_web.state()["traffic"]["fc"]["bytes_received"] > received, "more telemetry")


def test_metrics_are_served(shared_web: WebBench) -> None:
    """Their contents are tested in tests/service/web/test_metrics.py."""
    answer = shared_web.ask("/metrics")
    assert answer.status == 200
    assert answer.headers["Content-Type"].startswith("text/plain; version=0.0.4")
    sample = f'naze_bridge_missions_total{{ack="ACCEPTED",vehicle="{host_name()}"}} 1.0'
    assert sample in answer.body.decode()


def test_every_change_is_explained(shared_web: WebBench) -> None:
    mission = shared_web.ask("/api/missions/1").data
    changes = {row["left"]["seq"]: row["changes"] for row in mission["rows"] if row["changes"]}
    assert changes == {
        0: {"p2": "2..255 m"},
        1: {"alt_m": "take-off 2..15 m"},
        5: {"command": "not supported"},
        6: {"alt_m": "whole numbers only"},
        7: {"p1": "0 = fly through, 1 = brake; to hold use LOITER_TIME"},
        8: {"p2": "2..255 m"},
        9: {"alt_m": "0 not allowed"},
        10: {"p1": "seconds 1..255"},
    }
    assert [row["kind"] for row in mission["rows"]].count("dropped") == 1
    assert len(mission["findings"]) == 8


def test_an_earlier_mission_is_restored(web: WebBench) -> None:
    assert web.board is not None
    web.daemon.push(plain_plan(9))
    first = web.board.records()
    web.push_example()
    ended = web.restore(1)
    assert (ended["ok"], ended["what"]) == (True, "mission 1")
    assert ended["text"].startswith("9 of 9 stored: ")
    assert web.board.records() == first
    newest = web.daemon.missions()[0]
    assert (newest["number"], newest["source"], newest["outcome"]) == (3, "restore of mission 1", "VERIFIED")


def test_refuses_a_restore_while_armed(web: WebBench) -> None:
    assert web.board is not None
    web.daemon.push(plain_plan(9))
    web.push_example()
    held = web.board.records()
    web.board.set("armed 1")
    until(lambda: web.state()["status"]["armed"], "the armed craft")
    ended = web.restore(1)
    assert (ended["ok"], ended["text"]) == (False, "Armed: disarm to change the mission")
    assert web.board.records() == held


def test_refuses_a_restore_while_armed_in_mavlink_mode(start: Starter) -> None:
    board = start.board("--tele-prot", "2")
    web = web_daemon(start, str(board.link))
    web.daemon.push(plain_plan(9))
    board.set("armed 1")
    state = until(
        lambda: (now := web.state())["link"]["state"] == "MAVLink" and now["status"]["armed"] and now, "MAVLink"
    )
    assert state["traffic"]["fc"]["bytes_received"] > 0
    ended = web.restore(1)
    assert not ended["ok"]
    assert "rmed" in ended["text"]


def test_only_one_restore_runs_at_a_time(web: WebBench) -> None:
    assert web.board is not None
    web.daemon.push(plain_plan(9))
    web.board.set("hang 1")
    begin = ("/api/missions/1/restore", "POST")
    headers = {"Authorization": f"Bearer {web.token}"}
    # Together: the bridge gives the hung board up, and the restore with it, after 2 s.
    with ThreadPoolExecutor() as pool:
        answers = list(pool.map(lambda _: web.ask(*begin, **headers), range(2)))
    first, second = sorted(answers, key=lambda answer: answer.status)
    assert first.status == 202
    assert (second.status, second.data["error"]) == (
        409,
        "Something else is being written: wait until it has finished.",
    )
    web.board.set("hang 0")
    until(lambda: web.state()["write"]["done"], "the end of the first restore")


def test_restoring_a_missing_mission_fails_with_a_sentence(shared_web: WebBench) -> None:
    ended = shared_web.restore(77)
    assert not ended["ok"]
    assert ended["text"].startswith("there is no mission 77")


def test_a_stop_ends_a_restore(web: WebBench) -> None:
    assert web.board is not None
    web.daemon.push(plain_plan(9))
    web.board.set("hang 1")
    assert web.ask("/api/missions/1/restore", "POST", Authorization=f"Bearer {web.token}").status == 202
    assert web.daemon.end() == 0
    assert "Traceback" not in web.daemon.printed
    web.board.set("hang 0")


def test_a_refused_list_is_shown_with_the_reason(start: Starter) -> None:
    web = web_daemon(start)
    answer = web.daemon.ask({"do": "push", "source": "<b>mine</b>", "items": REFUSED})
    assert answer["verdict"] == "REJECTED"
    mission = web.ask("/api/missions/1").data
    assert mission["source"] == "<b>mine</b>"
    assert [row["kind"] for row in mission["rows"]] == ["same", "same", "rejected"]
    assert mission["rows"][2]["changes"]["command"].startswith("TAKEOFF must be item 1")


def _item(seq: int, command: int) -> dict[str, float]:
    place = {"lat_e7": 453838000 + seq * 1000, "lon_e7": 84733000, "alt_m": 10.0}
    return {"seq": seq, "command": command, "frame": 3, "p1": 0, "p2": 3, "p3": 0, "p4": 0, **place}


REFUSED = [_item(0, 16), _item(1, 16), _item(2, 22)]


def test_signing_times_are_forgotten_with_the_token_only(shared_web: WebBench) -> None:
    assert shared_web.ask("/api/signing/reset", "POST").status in (401, 403)
    done = shared_web.ask("/api/signing/reset", "POST", Authorization=f"Bearer {shared_web.token}")
    assert done.data == {"text": "Signing times forgotten: the next ground station with the key sets the time"}

# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pilot sees in sessions with QGroundControl's own code: no false dialog, banner or state in the toolbar."""

import time

import pytest

from tests.e2e.test_inav_clients import FENCE, RALLY, nav_plan
from tests.real_qgroundcontrol.conftest import Sessions
from tests.support.plan import PlanRow, plain_plan
from tests.support.real_qgc import RealQgc

#: Buttons and commands of a pilot, and the text beside the program's own dialog; None for a dialog of its own.
BUTTONS: dict[tuple[str, ...], str | None] = {
    ("arm", "1"): "Arm and disarm with the transmitter",
    ("takeoff",): None,
    ("goto",): "Fly the craft with the transmitter",
    ("roi",): "Not supported: DO_SET_ROI_LOCATION",
    ("sethome",): "Home is set where the craft is armed",
    ("setwp", "2"): "This flight controller cannot fly missions",
    ("calibrate", "1"): "Not supported: PREFLIGHT_CALIBRATION",
    ("camera",): "Cameras and gimbals are not controlled here",
    ("startMission",): None,
    ("emergencyStop",): "Arm and disarm with the transmitter",
}
KINDS = {"naze": (), "inav": ("--kind", "inav"), "multiwii": ("--kind", "multiwii")}
#: Boards without a list to show, and the word by which an upload is refused.
WITHOUT_LIST = {
    "unpatched": (("--no-extension",), "MSP", "is not supported"),
    "armed": (("--armed", "--tele-prot", "2"), "MAVLink", "Not accepting"),
    "no missions": (("--kind", "betaflight"), "MSP", "is not supported"),
}


def alarms(qgc: RealQgc, since: float = 0.0) -> list[str]:
    """Dialogs and banners."""
    return qgc.seen("dialog", since) + qgc.seen("banner", since)


def spoken(qgc: RealQgc) -> list[str]:
    """Without the mode and "armed", which it always says."""
    return [text for text in qgc.seen("voice") if not text.endswith(("flight mode", " armed"))]


def plan_for(kind: str) -> list[PlanRow]:
    return nav_plan(20) if kind == "inav" else plain_plan(24)


@pytest.mark.parametrize("kind", KINDS)
def test_a_quiet_flight_controller_shows_a_ready_craft(session: Sessions, kind: str) -> None:
    qgc, _ = session(*KINDS[kind])
    time.sleep(3)
    assert len(qgc.parameters()) > 90
    shown = {name: qgc.current(name) for name in ("status", "colour", "prearm", "healthy")}
    assert shown == {"status": "Ready", "colour": "green", "prearm": "", "healthy": "True"}
    assert (alarms(qgc), spoken(qgc)) == ([], [])


@pytest.mark.parametrize("kind", KINDS)
def test_a_mission_is_uploaded_and_downloaded(session: Sessions, kind: str) -> None:
    qgc, _ = session(*KINDS[kind])
    began, rows = qgc.now, plan_for(kind)
    qgc.write(rows)
    qgc.wait_for("message", f"{len(rows)} of {len(rows)} ")
    _, items = qgc.read()
    assert [item[0] for item in items] == [row.command for row in rows]
    assert alarms(qgc, began) == []


def test_a_fence_and_rally_points_are_uploaded_and_downloaded_on_an_inav(session: Sessions) -> None:
    qgc, _ = session("--kind", "inav")
    for tab, rows in (("FENCE", FENCE), ("RALLY", RALLY)):
        qgc.write(rows, tab=tab)
        _, items = qgc.read(tab)
        assert [(item[0], item[6], item[7]) for item in items] == [(row.command, row.lat, row.lng) for row in rows]
    assert alarms(qgc) == []


@pytest.mark.parametrize("board", WITHOUT_LIST)
def test_without_a_list_connecting_is_quiet_and_an_upload_is_refused(session: Sessions, board: str) -> None:
    options, state, word = WITHOUT_LIST[board]
    qgc, _ = session(*options, state=state)
    time.sleep(1)
    assert (alarms(qgc), spoken(qgc)) == ([], [])
    # At most home.
    assert len(qgc.read()[1]) <= 1
    qgc.write(plain_plan(10))
    (dialog,) = [text for text in qgc.seen("dialog") if "Mission transfer failed" in text]
    assert word.lower() in dialog.lower()
    assert qgc.seen("banner") == []


@pytest.mark.parametrize(("loss", "pause_s"), [(0.0, 0.1), (0.0, 0.15), (0.0, 0.4), (0.15, 0.15), (0.15, 0.4)])
def test_transfers_that_follow_at_once_do_not_end_each_other(session: Sessions, loss: float, pause_s: float) -> None:
    """A repeated final ack would end the next transfer with "Mission accepted". It comes within 60 ms."""
    qgc, _ = session(link={"loss": loss, "seed": 5})
    for number in range(6):
        qgc.write(plain_plan(4 + number))
        time.sleep(pause_s)
        qgc.read()
        time.sleep(pause_s)
    assert not [text for text in qgc.seen("failed") if "accepted" in text.lower()]
    assert loss or alarms(qgc) == []


def test_a_parameter_is_set_and_a_refused_value_is_a_failure(session: Sessions) -> None:
    qgc, _ = session()
    qgc.do("set", "P_ROLL", "44")
    qgc.wait_for("set", "P_ROLL")
    assert alarms(qgc) == []
    began = qgc.now
    qgc.do("set", "P_ROLL", "201")
    qgc.wait_for("unset", "P_ROLL")
    assert qgc.seen("dialog", began) == ["Parameter write failed: param: P_ROLL "]
    qgc.wait_for("message", "P_ROLL stays 44: 1..200", began)
    assert qgc.parameters()["P_ROLL"] == 44


def test_each_button_is_answered_without_a_banner(session: Sessions) -> None:
    qgc, _ = session()
    qgc.write(plain_plan(5))
    for button, text in BUTTONS.items():
        began = qgc.now
        qgc.do(*button)
        if text is not None:
            qgc.wait_for("message", text, began)
        time.sleep(4)
        assert len(qgc.seen("dialog", began)) <= 1, button
        assert (qgc.seen("banner", began), "".join(qgc.seen("prearm", began))) == ([], ""), button


def test_all_parameters_arrive_over_a_bad_link(session: Sessions) -> None:
    qgc, _ = session("--kind", "inav", link={"loss": 0.1, "seed": 2})
    assert len(qgc.parameters()) > 100
    assert alarms(qgc) == []


def test_a_lost_craft_is_not_ready(session: Sessions) -> None:
    qgc, board = session()
    for away, back in (("power off", "power on"), ("unplug", "plug")):
        began = qgc.now
        board.set(away)
        qgc.wait_for("status", "Not Ready", began)
        qgc.wait_for("prearm", "PreArm: flight controller lost", began)
        returned = qgc.now
        board.set(back)
        qgc.wait_for("message", "Flight controller back", returned)
        qgc.wait_for("status", "Ready", returned)
    assert (alarms(qgc), qgc.seen("error")) == ([], [])


def test_a_flight_shows_armed_flying_and_ready(session: Sessions) -> None:
    qgc, board = session()
    board.set("armed 1")
    assert qgc.wait_for("status", "ing") == "Flying"
    began = qgc.now
    board.set("power off")
    qgc.wait_for("status", "Armed", began)
    began = qgc.now
    board.set("power on")
    board.set("armed 0")
    qgc.wait_for("status", "Ready", began)
    assert not [text for text in qgc.seen("prearm") if "ready" in text]

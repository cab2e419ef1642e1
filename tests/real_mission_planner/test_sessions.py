# SPDX-License-Identifier: GPL-3.0-or-later
"""What a pilot sees in sessions with Mission Planner's own code: no false dialog, and no false line on the HUD."""

import time

import pytest

from tests.e2e.test_inav_clients import FENCE, RALLY, nav_plan
from tests.real_mission_planner.conftest import Sessions
from tests.support.plan import PlanRow, plain_plan
from tests.support.real_planner import RealPlanner

KINDS = {"naze": (), "inav": ("--kind", "inav"), "multiwii": ("--kind", "multiwii")}
NO_ARMING, FLY = "Arm and disarm with the transmitter", "Fly the craft with the transmitter"
#: A reason is given once for attempts that follow faster.
ATTEMPT_S = 2
FAILED = "The Command failed to execute"
#: The control and the choice, the button, the title of the dialog, the line on the HUD.
BUTTONS = {
    "arm": ("", "", "BUT_ARM_Click", "Arm failed", NO_ARMING),
    "mode": ("CMB_modes", "RTL", "BUT_setmode_Click", "", "Modes are set with the transmitter switches"),
    "set WP": ("CMB_setwp", "2", "BUT_setwp_Click", "", "This flight controller cannot fly missions"),
    "fly here": ("", "", "goHereToolStripMenuItem_Click", "", FLY),
    "take off": ("", "", "takeOffToolStripMenuItem_Click", "", FLY),
    "home": ("", "", "setHomeHereToolStripMenuItem_Click", "", "Home is set where the craft is armed"),
    "trigger": ("", "", "triggerCameraToolStripMenuItem_Click", "", "Cameras and gimbals are not controlled here"),
    "safety": ("CMB_action", "Toggle_Safety_Switch", "BUTactiondo_Click", "", NO_ARMING),
    "parachute": ("CMB_action", "Do_Parachute", "BUTactiondo_Click", FAILED, "Not supported: DO_PARACHUTE"),
    "loiter": ("CMB_action", "Loiter_Unlim", "BUTactiondo_Click", FAILED, FLY),
}  # fmt: skip


def dialogs(planner: RealPlanner, since: float) -> list[str]:
    """Without the questions that the pilot agrees to."""
    return [text for text in planner.seen("dialog", since) if "re you sure" not in text]


def plan_for(kind: str) -> list[PlanRow]:
    return nav_plan(20) if kind == "inav" else plain_plan(24)


@pytest.mark.parametrize("kind", KINDS)
def test_a_quiet_flight_controller_shows_a_ready_craft(session: Sessions, kind: str) -> None:
    planner, _ = session(*KINDS[kind])
    time.sleep(3)
    assert len(planner.parameters()) > 90
    shown = {name: planner.current(name) for name in ("ready", "armed", "failsafe", "safe", "line")}
    assert shown == {"ready": "True", "armed": "False", "failsafe": "False", "safe": "False", "line": ""}
    assert int(planner.current("link")) >= 90
    assert planner.seen("voice") == []


@pytest.mark.parametrize("kind", KINDS)
def test_a_mission_is_written_and_read(session: Sessions, kind: str) -> None:
    planner, _ = session(*KINDS[kind])
    for fast in (False, True):
        began = planner.now
        rows = plan_for(kind)
        planner.write(rows, fast=fast)
        planner.wait_for("message", f"{len(rows)} of {len(rows)} ", began)
        shown, items = planner.read()
        assert (dialogs(planner, began), shown) == ([], [])
        assert [item[0] for item in items] == [row.command for row in rows]
    assert planner.seen("line") == [""]


def test_a_fence_and_rally_points_are_written_and_read_on_an_inav(session: Sessions) -> None:
    planner, _ = session("--kind", "inav")
    for tab, rows in (("FENCE", FENCE), ("RALLY", RALLY)):
        planner.write(rows, tab=tab)
        planner.wait_for("message", "verified")
        _, items = planner.read(tab)
        assert [(item[0], item[6], item[7]) for item in items] == [(row.command, row.lat, row.lng) for row in rows]
    assert dialogs(planner, 0) == []


def test_unsupported_rally_points_are_refused_on_write_and_empty_on_read(session: Sessions) -> None:
    planner, _ = session()
    assert planner.read("RALLY")[1] == []
    assert dialogs(planner, 0) == []
    time.sleep(ATTEMPT_S)
    planner.write(RALLY, tab="RALLY")
    planner.wait_for("line", "Fences and rally points are not stored here")
    (dialog,) = dialogs(planner, 0)
    assert "UNSUPPORTED" in dialog


def test_a_parameter_is_set_and_a_refused_value_is_a_failure(session: Sessions) -> None:
    planner, _ = session()
    planner.do("set", "P_ROLL", "44")
    planner.wait_for("dialog", "1 parameters successfully saved")
    began = planner.now
    planner.do("set", "P_ROLL", "201")
    assert dialogs(planner, began) == [": Set P_ROLL Failed"]
    assert planner.wait_for("line", "P_ROLL", began) == "P_ROLL stays 44: 1..200"


def test_every_button_has_a_true_answer(session: Sessions) -> None:
    planner, _ = session()
    for name, (control, choice, button, dialog, line) in BUTTONS.items():
        began = planner.now
        if control:
            planner.choose(control, choice)
        planner.press(button)
        time.sleep(1)
        shown = dialogs(planner, began)
        assert len(shown) == bool(dialog), (name, shown)
        assert not dialog or dialog in shown[0], (name, shown)
        assert planner.current("line") == line, name


def test_the_accelerometer_page_ends_with_success(session: Sessions) -> None:
    planner, _ = session()
    for button in ("BUT_calib_accell_Click", "BUT_level_Click", "BUT_simpleAccelCal_Click"):
        began = planner.now
        planner.press(button, "ConfigAccelerometerCalibration")
        planner.wait_for("message", "Accel calibration successful", began)
        assert (dialogs(planner, began), "False" in planner.seen("ready", began)) == ([], True)
        planner.wait_for("ready", "True", began)


def test_the_compass_page_ends_with_success(session: Sessions) -> None:
    planner, _ = session("--kind", "multiwii")
    page = "ConfigHWCompass2"
    planner.press("BUT_OBmagcalstart_Click", page)
    planner.wait_for("message", "Turn the craft about all axes")
    planner.wait_for("message", "Compass calibration successful")
    planner.press("timer1_Tick", page)
    assert "MAG_CAL_SUCCESS" in planner.current("compass")
    planner.press("BUT_OBmagcalaccept_Click", page)
    assert dialogs(planner, 0) == []


def test_resume_mission_keeps_the_rest_and_names_the_way_back(session: Sessions) -> None:
    planner, board = session()
    rows = plain_plan(24)
    planner.write(rows)
    began = planner.now
    planner.do("answer", "10")
    planner.do("press", "FlightData", "BUT_resumemis_Click", end="item")
    planner.wait_for("message", "The previous whole mission: see Missions", began)
    assert len(board.records()) < len(rows)
    # It asks for the mode every second, for 30 s: the reason stays on the HUD.
    planner.wait_for("line", "Modes are set with the transmitter switches", began)
    assert planner.seen("voice", began).count("Modes are set with the transmitter switches") == 1
    assert dialogs(planner, began) == []


def test_a_joystick_is_refused_with_one_text(session: Sessions) -> None:
    planner, _ = session()
    planner.do("joystick", 120)
    assert planner.seen("voice") == ["Joystick ignored: fly with the transmitter"]


def test_a_read_from_a_board_armed_before_connecting_is_silent(session: Sessions) -> None:
    planner, _ = session("--armed", "--tele-prot", "2", state="MAVLink")
    planner.wait_for("armed", "True")
    # Mission Planner takes the first item for home.
    assert len(planner.read()[1]) <= 1
    planner.wait_for("message", "Armed, mission not known: disarm to read it")
    assert dialogs(planner, 0) == []
    time.sleep(ATTEMPT_S)
    planner.write(plain_plan(24))
    (dialog,) = dialogs(planner, 0)
    assert "DENIED" in dialog


def test_a_lost_craft_is_reported_and_not_ready(session: Sessions) -> None:
    planner, board = session()
    for away, back in (("power off", "power on"), ("unplug", "plug")):
        began = planner.now
        board.set(away)
        planner.wait_for("failsafe", "True", began)
        planner.wait_for("ready", "False", began)
        planner.wait_for("voice", "Flight controller lost", began)
        planner.wait_for("line", "PreArm: flight controller lost", began)
        returned = planner.now
        board.set(back)
        planner.wait_for("message", "Flight controller back", returned)
        planner.wait_for("ready", "True", returned)
        planner.wait_for("failsafe", "False", returned)
    assert dialogs(planner, 0) == []


def test_an_armed_craft_refuses_a_write_and_can_be_read(session: Sessions) -> None:
    planner, board = session()
    rows = plain_plan(24)
    planner.write(rows)
    board.set("armed 1")
    planner.wait_for("armed", "True")
    for fast in (False, True):
        began = planner.now
        planner.write(rows, fast=fast)
        (dialog,) = dialogs(planner, began)
        assert "DENIED" in dialog
        planner.wait_for("message", "Armed: disarm to change the mission", began)
        assert len(planner.read()[1]) == len(rows)
        time.sleep(ATTEMPT_S)


@pytest.mark.parametrize(
    "link",
    [{"loss": 0.03}, {"delay_s": 0.2}, {"repeats": 0.3, "delay_s": 0.05, "jitter_s": 0.1}],
    ids=["loss", "delay", "copies"],
)
def test_on_a_bad_link_a_mission_arrives_or_its_loss_is_reported(session: Sessions, link: dict[str, float]) -> None:
    planner, board = session(link={**link, "seed": 3})
    rows = plain_plan(15)
    planner.write(rows)
    assert dialogs(planner, 0) == []
    assert len(board.records()) == len(rows)
    began, longer = planner.now, plain_plan(26)
    planner.write(longer, fast=True)
    # An upload of which items are missing ends after a few seconds.
    time.sleep(8)
    is_told = any("NOT written" in text for text in planner.seen("voice", began))
    assert len(board.records()) == (len(rows) if is_told else len(longer))
    assert dialogs(planner, began) == []

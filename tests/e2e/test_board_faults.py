# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller loses power, hangs, garbles, is unplugged or replaced; the daemon is killed.

The pilot is told in time, the old list is intact, and a second attempt works.
"""

from collections.abc import Callable

import pytest

from protocols.mission_item import MissionResult
from tests.support.benches import Bench, Starter
from tests.support.mission_planner import MissionPlanner, UploadFailed
from tests.support.plain_station import udp_station
from tests.support.plan import judge, plain_plan, records_of
from tests.support.programs import run_naze_bridge, until

OLD, NEW = plain_plan(40), plain_plan(146, start=40)


@pytest.fixture
def planner(bench: Bench) -> MissionPlanner:
    """With its real timers, so that a late refusal becomes a timeout, a different error."""
    planner = bench.mission_planner()
    planner.write(OLD)
    return planner


def assert_denied(act: Callable[[], None]) -> None:
    """Assert that the user is told before Mission Planner gives up waiting."""
    with pytest.raises(UploadFailed) as refused:
        act()
    assert refused.value.result is MissionResult.DENIED, refused.value


def assert_old_list(bench: Bench) -> None:
    assert bench.board.records() == records_of(judge(OLD))
    assert bench.daemon.pull()["records"] == records_of(judge(OLD))


def assert_retry_works(bench: Bench, planner: MissionPlanner) -> None:
    bench.daemon.wait()
    planner.write(NEW)
    assert bench.board.records() == records_of(judge(NEW))
    assert bench.daemon.missions()[0]["outcome"] == "VERIFIED"


def test_a_board_that_hangs_while_items_arrive_keeps_the_old_list(bench: Bench, planner: MissionPlanner) -> None:
    planner.write_begun(NEW, 20)
    bench.board.set("hang 1")
    assert_denied(lambda: planner.write_rest(NEW, 20))
    bench.board.set("hang 0")
    bench.daemon.wait()
    assert_old_list(bench)
    assert_retry_works(bench, planner)


def test_a_board_is_found_after_unplugging_during_a_write(bench: Bench, planner: MissionPlanner) -> None:
    planner.write_begun(NEW, 20)
    bench.board.set("unplug")
    assert_denied(lambda: planner.write_rest(NEW, 20))
    planner.wait_for_text("Flight controller lost")
    planner.listen(1.5)
    assert planner.read_hud() == "Flight controller lost during the upload"
    assert_denied(lambda: planner.write(NEW))
    planner.wait_for_text("No link to the flight controller")
    bench.board.set("plug")
    bench.daemon.wait()
    assert_old_list(bench)
    assert_retry_works(bench, planner)
    lost = bench.daemon.has_logged("fc.port_lost")
    assert lost is not None
    assert lost["level"] == "warning"


def test_a_board_left_in_the_command_line_is_reported(start: Starter) -> None:
    board = start.board()
    with board.link.open("r+b", buffering=0) as terminal:
        terminal.write(b"\r\r\r")
        until(lambda: board.stats()["cli_entered"], "the command line")
    daemon = start.daemon(str(board.link))
    daemon.wait("command line")
    trouble = "Board in its CLI: type exit, or unplug it"
    done = run_naze_bridge("status", "--state-dir", str(daemon.state_dir))
    assert trouble in done.stdout
    planner = MissionPlanner(daemon.address)
    with planner:
        planner.skip_connecting()
        planner.wait_for_text("in its CLI: type")
        assert_denied(lambda: planner.write(NEW))
        with board.link.open("r+b", buffering=0) as terminal:
            terminal.write(b"exit\r")
        daemon.wait()
        planner.write(NEW)
    assert board.records() == records_of(judge(NEW))
    assert board.stats()["hazard_runs"] == 1


def test_a_replaced_boards_list_is_read(start: Starter) -> None:
    """The bridge uses its copy only while its checksum equals the board's."""
    bench = start.bench()
    with udp_station(bench.daemon.address) as station:
        station.send_heartbeat()
        assert station.upload(OLD) is MissionResult.ACCEPTED
        assert len(station.download()) == len(OLD)
        bench.board.end()
        board = start.board()
        until(lambda: bench.daemon.has_logged("fc.port_lost"), "the loss of the port")
        bench.daemon.wait()
        assert board.records() == []
        assert len(station.download()) <= 1  # home


# -- other flight controllers --------------------------------------------------------------------------------


def refusal_by(bench: Bench, reason: str) -> MissionResult | None:
    planner = bench.mission_planner()
    with pytest.raises(UploadFailed) as refused:
        planner.write(plain_plan(12))
    planner.wait_for_text(reason)
    return refused.value.result


def test_a_harakiri_without_the_extension_refuses_missions(start: Starter) -> None:
    bench = start.bench("--no-extension")
    assert refusal_by(bench, "lacks the mission patch") is MissionResult.UNSUPPORTED
    found = bench.daemon.has_logged("fc.found")
    assert found is not None
    assert "Harakiri" in found["name"]
    bench.board.assert_unharmed()


def test_a_harakiri_that_speaks_mavlink_while_armed_is_one_vehicle(start: Starter) -> None:
    board = start.board("--armed", "--tele-prot", "2")
    daemon = start.daemon(str(board.link))
    daemon.wait("MAVLink")
    with MissionPlanner(daemon.address) as planner:
        planner.wait_for_vehicle()
        planner.wait_for_armed(True)
        assert_denied(lambda: planner.write(plain_plan(12)))
        board.set("armed 0")
        daemon.wait("MSP")
        planner.wait_for_armed(False)
        planner.write(plain_plan(12))
    assert board.records() == records_of(judge(plain_plan(12)))
    board.assert_unharmed()


# -- the daemon ----------------------------------------------------------------------------------------------


def test_an_acknowledged_mission_survives_an_immediate_kill(start: Starter) -> None:
    bench = start.bench()
    with udp_station(bench.daemon.address) as station:
        station.send_heartbeat()
        for number in range(3):
            plan = plain_plan(20 + number, start=number)
            assert station.upload(plan) is MissionResult.ACCEPTED
            bench.daemon.kill_and_restart()
            bench.daemon.wait()
            newest = bench.daemon.missions()[0]
            assert (newest["outcome"], newest["item_count"]) == ("VERIFIED", len(plan))
            assert len(bench.daemon.missions()) == number + 1
            shown = bench.daemon.ask({"do": "mission", "number": newest["number"]})
            assert shown["received"]["records"] == "".join(records_of(judge(plan)))
            assert bench.board.records() == records_of(judge(plan))


def test_a_kill_during_an_upload_keeps_the_old_list(bench: Bench, planner: MissionPlanner) -> None:
    planner.write_begun(NEW, 100)
    bench.daemon.kill_and_restart()
    bench.daemon.wait()
    assert_old_list(bench)
    assert_retry_works(bench, planner)

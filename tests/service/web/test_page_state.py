# SPDX-License-Identifier: GPL-3.0-or-later
"""The page's state bar, and parts that an update must not change."""

import socket
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as messages

from tests.support.chromium import PHONE, Browser, Browsers
from tests.support.plain_station import PlainStation
from tests.support.plan import plain_plan
from tests.support.programs import until
from tests.support.web_bench import WebBench

pytest_plugins = ("tests.support.web_fixtures",)


def test_the_state_bar_stays_visible(browsers: Browsers, web: WebBench) -> None:
    assert web.board is not None
    with browsers.tab(web.port, PHONE) as page:
        page.open()
        page.wait_text("#badges", "DISARMED")
        page.run("scrollTo(0, document.body.scrollHeight)")
        assert page.run("return document.getElementById('badges').getBoundingClientRect().top") >= 0
        assert page.run("return document.querySelector('header').offsetHeight") < PHONE[1] / 10

        web.board.set("armed 1")
        until(lambda: page.text("#badges") == "ARMED", "the armed craft")
        red = page.run("return getComputedStyle(document.querySelector('.badge')).backgroundColor")
        until(lambda: page.driver.title == "ARMED · naze-bridge", "the title")
        assert page.text("#spoken") == "armed"

        web.board.set("unplug")
        page.wait_text("#badges", "LOST")
        page.wait_text("#badges", "WAS ARMED")
        assert page.run("return getComputedStyle(document.querySelector('.badge')).backgroundColor") == red
        page.wait_text("#vehicle-age", "Last heard")

        web.daemon.end()
        page.wait_text("#badges", "NO REPLY FROM THE PI")
        page.wait_text("#badges", "WAS ARMED")
        page.wait_text("#trouble", "The Pi does not answer. The values below may be old.")


@pytest.fixture(scope="module")
def laptop(browsers: Browsers, shared_web: WebBench) -> Iterator[Browser]:
    with browsers.tab(shared_web.port) as laptop:
        yield laptop


@pytest.fixture
def page(laptop: Browser) -> Browser:
    laptop.open()
    laptop.wait_text("#badges", "DISARMED")
    return laptop


def test_old_values_are_marked_stale(shared_web: WebBench, page: Browser) -> None:
    assert shared_web.board is not None
    shared_web.board.set("hang 1")
    until(lambda: {"STALE", "LOST"} & set(page.text("#badges").split()), "the warning")
    shared_web.board.set("hang 0")
    until(lambda: page.text("#badges") == "DISARMED", "the craft again")


def test_the_page_itself_notices_that_replies_stop(page: Browser) -> None:
    """The request that nobody answers fails only after seconds, here never: until then DISARMED was green."""
    page.run("window.fetch = () => new Promise(() => {})")
    page.wait_text("#badges", "NO REPLY FROM THE PI")
    assert page.run("return document.body.classList.contains('stale')")


UPGRADE = """
    const fetched = window.fetch;
    window.fetch = async (path, ...options) => {
        const reply = await fetched(path, ...options);
        return path === "/api/state" ? new Response(JSON.stringify({ ...await reply.json(), version: "99" })) : reply;
    };
    document.body.dataset.isOld = true;"""


def test_an_open_page_is_loaded_again_after_an_upgrade(page: Browser) -> None:
    page.run(UPGRADE)
    until(lambda: page.run("return document.body && !document.body.dataset.isOld"), "a new page")
    page.wait_text("#badges", "DISARMED")


@pytest.mark.parametrize(
    ("received", "words"), [("count += 400", "bytes arrive, but no frames"), ("count", "silence. Check power")]
)
def test_while_searching_the_page_shows_the_bytes_on_the_wire(page: Browser, received: str, words: str) -> None:
    page.run(
        """
        const fetched = window.fetch;
        let count = 7;
        window.fetch = async (path, ...options) => {
            const reply = await fetched(path, ...options);
            if (path !== "/api/state") return reply;
            const state = await reply.json();
            state.link.flight_controller = null;
            state.traffic.fc.bytes_received = COUNT;
            return new Response(JSON.stringify(state));
        };""".replace("COUNT", received)
    )
    page.wait_text("#headline", words)
    page.wait_for_updates(3)
    assert words in page.text("#headline")


LIVE = """
    return [...document.querySelectorAll('[role=status], [role=alert], [aria-live]')].map((e) => e.textContent);"""


def test_only_changes_are_announced_to_screen_readers(shared_web: WebBench, page: Browser) -> None:
    assert shared_web.board is not None
    before = page.run(LIVE)
    assert not any(before)
    page.wait_for_updates(3)
    assert page.run(LIVE) == before
    shared_web.board.set("armed 1")
    page.wait_text("#spoken", "armed")
    spoken = page.run(LIVE)
    page.wait_for_updates(3)
    assert page.run(LIVE) == spoken
    shared_web.board.set("armed 0")


def test_a_selection_survives_updates(shared_web: WebBench, page: Browser) -> None:
    page.show("check")
    page.run("""
        const all = [...document.querySelectorAll('dt')].find((e) => e.innerText === 'Firmware').nextElementSibling;
        getSelection().selectAllChildren(all);""")
    shared_web.daemon.push(plain_plan(9))
    page.wait_text("#held-text", "9 records")
    page.wait_for_updates(2)
    assert page.run("return String(getSelection())") == "Harakiri with the mission extension"


def test_an_upload_in_progress_has_a_bar(shared_web: WebBench, page: Browser) -> None:
    with PlainStation(udp_to(shared_web.daemon.address)) as station:
        station.send_heartbeat()
        station.send(messages.MAVLink_mission_count_message(1, 1, 20, 0))
        station.wait_for("MISSION_REQUEST")  # and then falls silent
        page.wait_text("#transfer-text", "Receiving items: 0 of 20")
        assert page.run("const bar = document.getElementById('transfer-bar'); return [bar.value, bar.max]") == [0, 20]
        until(
            lambda: page.run("return document.getElementById('transfer').hidden"),
            "the end of the abandoned upload",
        )


def udp_to(address: tuple[str, int]) -> socket.socket:
    connection = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    connection.connect(address)
    return connection

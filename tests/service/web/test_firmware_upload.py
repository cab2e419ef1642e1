# SPDX-License-Identifier: GPL-3.0-or-later
"""New firmware from the page: refused images over HTTP, and a flash in a browser."""

from contextlib import ExitStack
from pathlib import Path

import pytest

from protocols.firmware_image import PROGRAM_END
from simulator.naze.whole_flash import stand_in
from tests.service.web.test_sent_files import post
from tests.support.benches import Starter
from tests.support.chromium import PHONE, Browsers
from tests.support.programs import happens, until
from tests.support.web_bench import WebBench, web_daemon

pytest_plugins = ("tests.support.web_fixtures",)

PATCHED = stand_in(patched=True)
RESULT = "#firmware .result"
_LONGEST_S = 180.0


@pytest.mark.parametrize(
    ("name", "body", "why"),
    [
        ("x.hex", PATCHED, "not an Intel HEX file"),
        ("x.bin", stand_in(patched=False), "without the mission patch"),
        ("x.bin", PATCHED.ljust(PROGRAM_END + 1, b"\0"), "too large"),
        ("x.elf", bytes(1_000_001), "not a binary"),
    ],
)
def test_a_wrong_image_is_refused(shared_web: WebBench, name: str, body: bytes, why: str) -> None:
    answer = post(shared_web, f"/api/firmware?name={name}", body, Authorization=f"Bearer {shared_web.token}")
    assert answer.status == 422
    assert why in answer.data["error"]


def test_flashing_needs_the_token(shared_web: WebBench) -> None:
    assert post(shared_web, "/api/firmware?name=x.bin", PATCHED, Authorization="Bearer 2222222222222222").status == 401
    assert shared_web.board is not None
    assert not shared_web.board.stats()["bootloader_entered"]


def test_a_battery_is_refused_then_the_patch_is_flashed_from_a_phone(browsers: Browsers, tmp_path: Path) -> None:
    image = tmp_path / "patched.bin"
    image.write_bytes(PATCHED)
    with ExitStack() as stack:
        start = Starter(tmp_path, stack)
        board = start.board("--no-extension", "--boot", "300")
        bench = web_daemon(start, str(board.link))
        until(lambda: bench.state()["battery"]["voltage_v"], "the battery's voltage")
        with browsers.tab(bench.port, PHONE) as page:
            page.open("check", bench.token)
            page.unfold("#firmware-block")
            page.unfold("details:has(#link)")
            page.find("#image").send_keys(str(image))
            page.press("#firmware button.write")
            page.wait_text(RESULT, "Nothing was changed: a battery is connected")
            assert page.run("return window.innerWidth") == PHONE[0]
            page.press("#firmware label input")
            page.press("#firmware button.write")
            page.wait_text(RESULT, "Reading: ")
            wanted = "Harakiri with the mission extension runs; the flash was verified."
            assert happens(lambda: wanted in page.text(RESULT), _LONGEST_S), page.text(RESULT)
            page.wait_text("#link", "Harakiri with the mission extension")

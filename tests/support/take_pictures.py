# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes the pictures in docs/pictures: `make pictures`."""

import os
import sys
import tempfile
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from tests.support.benches import Starter
from tests.support.chromium import PHONE, Browser, Browsers
from tests.support.helper_bench import helper_bench
from tests.support.plan import plain_plan
from tests.support.web_bench import EXAMPLE, WebBench, web_daemon

_LAPTOP = (1280, 720)
PICTURES = Path(__file__).parents[2] / "docs" / "pictures"


def take_pictures(folder: Path) -> None:
    """Save pictures of each task: on a laptop, on a phone, and without a board."""
    with tempfile.TemporaryDirectory() as name, closing(Browsers()) as browsers:
        with pytest.MonkeyPatch.context() as patch, helper_bench(Path(name), patch) as (bench, _):
            bench.daemon.push(plain_plan(9))
            bench.push_example()
            with browsers.tab(bench.port, _LAPTOP) as laptop:
                laptop.open()
                laptop.wait_for_updates(2)
                laptop.picture(folder / "status-page.png")
            with browsers.tab(bench.port, PHONE) as phone:
                _take_on_a_phone(phone, bench, folder)
        bare = Path(name) / "bare"
        bare.mkdir()
        with ExitStack() as stack:
            silent = os.ttyname(os.openpty()[1])
            without_a_board = web_daemon(Starter(bare, stack), silent, has_board=False)
            with browsers.tab(without_a_board.port, PHONE) as phone:
                phone.open()
                phone.wait_for_updates(2)
                phone.picture(folder / "no-board.png")


def _take_on_a_phone(phone: Browser, bench: WebBench, folder: Path) -> None:
    phone.open("fly", bench.token)
    phone.wait_for_updates(2)
    phone.picture(folder / "fly.png")
    phone.show("mission")
    phone.find("#file").send_keys(str(EXAMPLE))
    phone.wait_text("#checked", "14 items")
    phone.wait_for_updates(2)
    phone.picture(folder / "mission.png")
    phone.show("check")
    phone.press("#doctor button")
    phone.wait_text("#findings", "fine")
    phone.unfold("#log-block")
    phone.wait_text("#log", "Flight controller found")
    phone.picture(folder / "check.png")
    phone.show("pi")
    phone.wait_text("#pi", "Raspberry Pi")
    phone.picture(folder / "pi.png")


if __name__ == "__main__":
    take_pictures(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES)

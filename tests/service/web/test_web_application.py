# SPDX-License-Identifier: GPL-3.0-or-later
"""The examples of other programs that use the page's interface: a web application of another server, and one in C."""

import shutil
import subprocess
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

from tests.support.benches import Starter
from tests.support.chromium import Browsers
from tests.support.web_bench import EXAMPLE, WebBench, web_daemon

pytest_plugins = ("tests.support.web_fixtures",)


def test_the_example_shows_the_vehicle_and_checks_a_mission(browsers: Browsers, start: Starter) -> None:
    handler = partial(SimpleHTTPRequestHandler, directory=EXAMPLE.parent)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        port = server.server_address[1]
        web = web_daemon(start, web=f'origins = ["http://127.0.0.1:{port}"]')
        with browsers.tab(port) as page:
            page.driver.get(f"{page.url}web-application.html?pi=http://127.0.0.1:{web.port}")
            page.wait_text("#vehicle", "Harakiri with the mission extension: disarmed, STABILIZE")
            page.find("#file").send_keys(str(EXAMPLE))
            page.wait_text("#verdict", "349 m")
        server.shutdown()


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_the_example_in_c_prints_the_battery(shared_web: WebBench, tmp_path: Path) -> None:
    program = tmp_path / "vehicle_state"
    subprocess.run(["cc", "-Wall", "-Werror", "-o", program, EXAMPLE.parent / "vehicle_state.c"], check=True)
    told = subprocess.run([program, "127.0.0.1", str(shared_web.port)], capture_output=True, text=True, check=True)
    assert told.stdout == 'flight_controller: "Harakiri with the mission extension"\nvoltage_v: 12.6\n'
    assert subprocess.run([program, "127.0.0.1", "1"], capture_output=True, check=False).returncode == 1

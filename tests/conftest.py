# SPDX-License-Identifier: GPL-3.0-or-later

import gc
import os
import random
import signal
from collections.abc import Generator, Mapping

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from service.machine.event_loop import EventLoop

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts background jobs with SIGINT ignored, and programs started by tests would inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# No deadlines: the machine may be busy. A short form of each search, always the same, so that a change does not fail by
# chance: `make fuzz` has the long one, of other examples each time.
settings.register_profile(
    "unhurried",
    deadline=None,
    max_examples=int(os.environ.get("FUZZ_EXAMPLES", "40")),
    derandomize="FUZZ_EXAMPLES" not in os.environ,
)
settings.load_profile("unhurried")
if "FUZZ_EXAMPLES" not in os.environ:
    # Hypothesis would parse all modules for constants, which takes 18 s of CPU in a fresh clone.
    vars(providers)["_get_local_constants"] = lambda: vars(providers)["_local_constants"]

#: The longest files. They start first; otherwise one of them could run alone at the end.
_LONG = (
    "tests/packaging/test_debian_package",
    "tests/firmware/test_firmware_core",
    "tests/e2e/test_firmware",
    "tests/service/web/test_firmware_upload",
    "tests/e2e/test_mavproxy",
    "tests/e2e/test_mission_planner",
    "tests/fleet/test_roll_call",
    "tests/bridge/controllers/harakiri/test_mission_store",
    "tests/e2e/test_soak",
    "tests/service/web/test_page_accessibility",
    "tests/service/test_loop_budget",
)
#: Folders of tests that mostly wait for programs, those with the longest files first.
_WAITING = tuple(
    f"tests/{name}/"
    for name in (
        *("service/web", "fleet", "e2e", "attack", "service/cli", "service/zenoh_link", "service/links"),
        *("service/settings", "simulator/links", "simulator/commands"),
    )
)
#: The marker `slow`, which an inner loop leaves out: these folders and files.
_SLOW = (
    *_WAITING,
    *(f"tests/{name}/" for name in ("conformance", "firmware", "packaging", "real_board", "scenarios")),
    *(f"tests/bridge/{name}" for name in (
        "controllers/harakiri/test_mission_store", "fc/test_profile", "settings/test_known_settings",
        "transfers/test_uploads",
    )),
    "tests/service/test_loop_budget",
)  # fmt: skip


def pytest_asyncio_loop_factories() -> Mapping[str, type[EventLoop]]:
    """The daemon's own."""
    return {"daemon": EventLoop}


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect the tests, which stay to the end, without looking for garbage among them then or later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let each worker read the files in another order: in a fresh clone it finds most of them compiled by others."""
    report = yield
    if isinstance(collector, pytest.Directory):
        random.Random(os.environ.get("PYTEST_XDIST_WORKER")).shuffle(report.result)
    return report


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the long files first, then alternate between files that wait and files that compute.

    This uses the cores better than one kind after the other. The order within a file is kept."""
    files = sorted({_file(item) for item in items})
    waiting = [file for folder in _WAITING for file in files if file.startswith(folder)]
    computing = [file for file in files if not file.startswith(_WAITING)]
    place = {file: at / len(kind) for kind in (waiting, computing) for at, file in enumerate(kind)}
    place |= {file: at - len(_LONG) for file in files for at, long in enumerate(_LONG) if file.startswith(long)}
    items.sort(key=lambda item: (place[_file(item)], _file(item)))
    for item in items:
        if item.nodeid.startswith(_SLOW):
            item.add_marker(pytest.mark.slow)


def _file(item: pytest.Item) -> str:
    return item.nodeid.partition("::")[0]

# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes the pictures in docs/pictures: `make pictures`."""

import sys
import tempfile
from contextlib import closing
from pathlib import Path

from tests.support.chromium import PHONE, Browsers
from tests.support.plan import plain_plan
from tests.support.web_bench import EXAMPLE, web_bench

#: High enough for the whole map.
_LAPTOP = (1100, 1060)
PICTURES = Path(__file__).parents[2] / "docs" / "pictures"


def take_pictures(folder: Path) -> None:
    """Save pictures of the page on a laptop and a phone, light and dark."""
    with tempfile.TemporaryDirectory() as name, web_bench(Path(name)) as bench, closing(Browsers()) as browsers:
        bench.daemon.push(plain_plan(9))
        bench.push_example()
        with browsers.tab(bench.port, _LAPTOP) as laptop:
            laptop.open()
            laptop.wait_for_updates(2)
            laptop.picture(folder / "status-page.png")
            laptop.run("document.getElementById('upload-title').scrollIntoView()")
            laptop.picture(folder / "sent-and-stored.png")
            laptop.find("#file").send_keys(str(EXAMPLE))
            laptop.wait_text("#checked", "14 items")
            laptop.wait_for_updates(2)
            laptop.run("document.getElementById('file-title').scrollIntoView()")
            laptop.picture(folder / "checked-file.png")
        with browsers.tab(bench.port, PHONE, dark=True) as phone:
            phone.open()
            phone.wait_for_updates(2)
            phone.run("document.getElementById('map-title').scrollIntoView()")
            phone.picture(folder / "on-a-phone.png")


if __name__ == "__main__":
    take_pictures(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES)

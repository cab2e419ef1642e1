# SPDX-License-Identifier: GPL-3.0-or-later
"""A zenoh router for a small fleet, from the Python package: `python zenoh_router.py [FILE or ENDPOINT...]`.

FILE is a zenoh configuration (zenoh-tls/router.json5); ENDPOINT is an address to listen on, by default
"tcp/0.0.0.0:7447". zenohd, the stand-alone router, does the same and more.
"""

import json
import os
import signal
import sys
from pathlib import Path

import zenoh

arguments = sys.argv[1:]
if arguments and arguments[0].startswith("-"):
    sys.exit(__doc__)
if arguments and arguments[0].endswith(".json5"):
    # The files that it names are in the same folder.
    file = Path(arguments[0]).absolute()
    os.chdir(file.parent)
    config = zenoh.Config.from_file(file)
else:
    config = zenoh.Config()
    config.insert_json5("listen/endpoints", json.dumps(arguments or ["tcp/0.0.0.0:7447"]))
config.insert_json5("mode", '"router"')
config.insert_json5("scouting/multicast/enabled", "false")
zenoh.init_log_from_env_or("error")
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
with zenoh.open(config) as session:
    print("Router", session.zid(), "is up. Ctrl-C ends.", flush=True)
    try:
        signal.pause()
    except KeyboardInterrupt:
        print()

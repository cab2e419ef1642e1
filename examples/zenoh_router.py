# SPDX-License-Identifier: GPL-3.0-or-later
"""A zenoh router for a small fleet, from the Python package: `python zenoh_router.py [FILE or ENDPOINT...]`.

FILE is a zenoh configuration (zenoh-tls/router.json5); ENDPOINT is an address to listen on, by default
"tcp/0.0.0.0:7447". zenohd, the stand-alone router, does the same and more.
"""

import json
import signal
import sys

import zenoh

arguments = sys.argv[1:]
if arguments and arguments[0].endswith(".json5"):
    config = zenoh.Config.from_file(arguments[0])
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

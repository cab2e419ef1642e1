# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVSDK 3, whose API differs from that of 4: writes COUNT waypoints to the vehicle at PORT, and reads them back.

Prints the number of items read, and a parameter. SERVER_PORT: for MAVSDK's own server.
"""

import asyncio
import sys

from mavsdk import System
from mavsdk.mission_raw import MissionItem


async def main(port: str, count: int, server_port: int) -> None:
    drone = System(port=server_port)
    await drone.connect(system_address=f"udpout://127.0.0.1:{port}")
    async for state in drone.core.connection_state():
        if state.is_connected:
            break
    nan = float("nan")
    items = [
        MissionItem(
            seq, 3 if seq else 0, 16, int(seq == 0), 1, 0.0, 0.0, 0.0, nan, 453838000 + 900 * seq, 84733000, 20.0, 0
        )
        for seq in range(count)
    ]
    await drone.mission_raw.upload_mission(items)
    read = await drone.mission_raw.download_mission()
    radius_cm = await drone.param.get_param_float("WPNAV_RADIUS")
    sys.stdout.write(f"{len(read)} {radius_cm}\n")


asyncio.run(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))

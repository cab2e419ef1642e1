# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m benchmarks.paced_inav`: a simulated INAV on a pseudo-terminal that keeps a UART's pace to the microsecond.

`naze-bridge sim` sleeps until its next byte is due, and an event loop oversleeps by up to a millisecond. When frames
wait for each other, that is a third of the measured time, so this program does not sleep for the last two milliseconds.
MSP is served every 50 us, practically at once. The first line of output is the terminal's path.
"""

import os
import pty
import select
import time
import tty

from simulator.board.msp_options import MspOptions
from simulator.commands.fc_kinds import make_board

_AWAKE_S = 0.002
_LONGEST_SLEEP_S = 0.05
_READ_SIZE = 4096


def main() -> None:
    """Run until killed."""
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    print(os.ttyname(theirs), flush=True)
    board = make_board("inav", MspOptions(serial_task_ms=0.05))
    board.power_on_booted(time.monotonic())
    while True:
        now = time.monotonic()
        data = board.advance(now)
        if data:
            os.write(ours, data)
        left = board.next_wakeup(now) - now - _AWAKE_S
        if select.select([ours], [], [], min(max(left, 0), _LONGEST_SLEEP_S))[0]:
            board.receive(os.read(ours, _READ_SIZE), time.monotonic())


if __name__ == "__main__":
    main()

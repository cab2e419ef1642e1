# SPDX-License-Identifier: GPL-3.0-or-later
"""The README's cast of `naze-bridge demo --once`: `python -m generators.terminal_cast > docs/pictures/demo.svg`.

The demonstration runs in a pseudo-terminal. Each line of the picture appears when it was printed, stretched to 20 s.
"""

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
import time
from html import escape
from pathlib import Path

_SECONDS, _HOLD = 20, 0.35  # the last part of the loop shows the result
_COLUMNS, _ROWS = 90, 60
_LINE_PX, _CHAR_PX, _MARGIN_PX = 17, 8.0, 14
_COLOURS = {"31": "bad", "32": "good", "33": "note"}
_CODE = re.compile(r"\x1b\[([\d;]*)m")
_OTHER = re.compile(r"\x1b\[[?\d;]*[A-Za-ln-z]")
_STYLE = """text{font:13px ui-monospace,monospace;fill:#e8ecef;white-space:pre;opacity:0}
.bad{fill:#ffa098}.good{fill:#74d48c}.note{fill:#ffe08a}@media(prefers-reduced-motion){text{opacity:1;animation:none!important}}"""


def record(command: list[str]) -> list[tuple[float, str]]:
    """Run a command in a terminal. Each line with the second at which it was complete."""
    near, far = pty.openpty()
    fcntl.ioctl(far, termios.TIOCSWINSZ, struct.pack("HHHH", _ROWS, _COLUMNS, 0, 0))
    process = subprocess.Popen(command, stdin=far, stdout=far, stderr=far, env=os.environ | {"TERM": "xterm"})  # noqa: S603
    os.close(far)
    began, lines, rest = time.monotonic(), [], ""
    while data := _read(near):
        *whole, rest = (rest + data.decode(errors="replace")).split("\n")
        lines += [(time.monotonic() - began, _OTHER.sub("", line).rstrip("\r").rpartition("\r")[2]) for line in whole]
    process.wait()
    return lines


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # the program has ended
        return b""


def picture(lines: list[tuple[float, str]]) -> str:
    """The lines as an animated SVG image."""
    end = lines[-1][0]
    height, width = len(lines) * _LINE_PX + 2 * _MARGIN_PX, _COLUMNS * _CHAR_PX + 2 * _MARGIN_PX
    rows, frames = [], []
    for number, (at, line) in enumerate(lines):
        percent = 1 + (1 - _HOLD) * 98 * at / end
        frames.append(f"@keyframes k{number}{{0%,{percent:.1f}%{{opacity:0}}{percent + 0.1:.1f}%,100%{{opacity:1}}}}")
        y = _MARGIN_PX + (number + 0.75) * _LINE_PX
        rows.append(
            f'<text x="{_MARGIN_PX}" y="{y:.0f}" style="animation:k{number} {_SECONDS}s infinite">{_spans(line)}</text>'
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height}" role="img">'
        f"<title>naze-bridge demo</title><style>{_STYLE}{''.join(frames)}</style>"
        f'<rect width="100%" height="100%" rx="8" fill="#14181b"/>{"".join(rows)}</svg>\n'
    )


def _spans(line: str) -> str:
    """A line with its colours."""
    text, colour, spans = "", "", []
    for index, piece in enumerate(_CODE.split(line)):
        if index % 2:
            colour = next((_COLOURS[code] for code in piece.split(";") if code in _COLOURS), "")
            continue
        text = escape(piece)
        spans.append(f'<tspan class="{colour}">{text}</tspan>' if colour and text else text)
    return "".join(spans)


if __name__ == "__main__":
    program = str(Path(sys.executable).with_name("naze-bridge"))
    shown = [(0.0, "$ naze-bridge demo --once"), *record([program, "demo", "--once"])]
    sys.stdout.write(picture(shown))

# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a simulated board until Ctrl-C."""

import asyncio
import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click

from simulator.board.simulated_board import SimulatedBoard
from simulator.links.control import Control, Plug
from simulator.links.pty_link import PlugError, PtyLink
from simulator.links.tcp_link import SimTcpLink


@dataclass(frozen=True, slots=True)
class Running:
    """The board's connections and scheduled events. Times in seconds.

    `link`: of a pseudo-terminal; `tcp`: host and port; one of them is set. `control`: a Unix socket.
    """

    link: Path | None = None
    tcp: tuple[str, int] | None = None
    control: Path | None = None
    hang_after: float | None = None
    power_cut_after: float | None = None
    #: Control lines, and when they are executed.
    script: tuple[tuple[float, str], ...] = ()


async def run_board(board: SimulatedBoard, name: str, running: Running, is_alive: Callable[[], bool]) -> None:
    """Run it. click.ClickException if its link or address is not available."""
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    board.power_on_booted(loop.time())
    plug: Plug
    if running.tcp:
        plug = SimTcpLink(board, running.tcp, loop, is_alive)
        place = "{}:{}".format(*running.tcp)
    else:
        assert running.link is not None
        plug = PtyLink(board, running.link, loop)
        place = f"{running.link}, {board.baud} baud"
    control = Control(board, plug, loop)

    def execute(line: str) -> None:
        if (answer := control.execute(line)) != "ok":
            click.echo(f"script: {line}: {answer}", err=True)

    if running.hang_after is not None:
        loop.call_later(running.hang_after, control.execute, "hang 1")
    if running.power_cut_after is not None:
        loop.call_later(running.power_cut_after, control.execute, "power off")
    for at, line in running.script:
        loop.call_later(at, execute, line)
    try:
        plug.plug()
        if running.control:
            await control.listen(running.control)
        click.echo(f"Simulated {name} at {place}. Ctrl-C ends it.")
        await stop.wait()
    except PlugError as error:
        raise click.ClickException(str(error)) from error
    except OSError as error:
        raise click.ClickException(f"{running.control} cannot be created: {error.strerror}") from error
    finally:
        plug.unplug()
        control.close()

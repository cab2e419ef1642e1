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
class RunOptions:
    """The board's connections and scheduled events. Times in seconds.

    `link`: of a pseudo-terminal. `tcp`: host and port. One of them is set. `control`: a Unix socket.
    """

    link: Path | None = None
    tcp: tuple[str, int] | None = None
    control: Path | None = None
    hang_after: float | None = None
    power_cut_after: float | None = None
    #: Control lines, and when they are executed.
    script: tuple[tuple[float, str], ...] = ()


async def run_board(board: SimulatedBoard, name: str, run_options: RunOptions, is_alive: Callable[[], bool]) -> None:
    """Run it. click.ClickException if the link or address is not available."""
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    board.power_on_booted(loop.time())
    plug: Plug
    if run_options.tcp:
        plug = SimTcpLink(board, run_options.tcp, loop, is_alive)
        place = "{}:{}".format(*run_options.tcp)
    else:
        assert run_options.link is not None
        plug = PtyLink(board, run_options.link, loop)
        place = f"{run_options.link}, {board.baud} baud"
    control = Control(board, plug, loop)

    def execute(line: str) -> None:
        if (answer := control.execute(line)) != "ok":
            click.echo(f"script: {line}: {answer}", err=True)

    if run_options.hang_after is not None:
        loop.call_later(run_options.hang_after, control.execute, "hang 1")
    if run_options.power_cut_after is not None:
        loop.call_later(run_options.power_cut_after, control.execute, "power off")
    for at, line in run_options.script:
        loop.call_later(at, execute, line)
    try:
        plug.plug()
        if run_options.control:
            await control.listen(run_options.control)
        click.echo(f"Simulated {name} at {place}. Ctrl-C ends it.")
        await stop.wait()
    except PlugError as error:
        raise click.ClickException(str(error)) from error
    except OSError as error:
        raise click.ClickException(f"{run_options.control} cannot be created: {error.strerror}") from error
    finally:
        plug.unplug()
        control.close()

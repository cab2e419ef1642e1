# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim --play`: the flight controller of a UART capture, on a pseudo-terminal."""

import asyncio
import signal
from pathlib import Path

import click

from protocols.uart_capture import read_capture
from simulator.commands.playback import CapturePlayer
from simulator.links.pty_link import PlugError, PtyLink


def play_capture(path: Path, link: Path, tempo: float) -> None:
    """Replay until Ctrl-C. The port appears and disappears as in the recording."""
    asyncio.run(_play(_player(path, tempo), path, link))


def _player(path: Path, tempo: float) -> CapturePlayer:
    try:
        events = read_capture(path.read_bytes())
    except OSError as error:
        raise click.ClickException(f"{path} cannot be read: {error.strerror}") from error
    if not events:
        raise click.ClickException(f"{path} is not a UART capture; make one with naze-bridge run --record-uart FILE")
    return CapturePlayer(events, tempo)


async def _play(player: CapturePlayer, path: Path, link: Path) -> None:
    loop = asyncio.get_running_loop()
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    began_at = loop.time()
    player.power_on_booted(began_at)
    port = PtyLink(player, link, loop)
    try:
        port.plug()
        for closed, opened in player.outages:
            loop.call_at(began_at + closed, port.unplug)
            loop.call_at(began_at + opened, port.plug)
        loop.call_at(began_at + player.duration_s, click.echo, "The capture has ended; its last replies are repeated.")
        click.echo(f"Playing {path} at {link} for {player.duration_s:.0f} s. Ctrl-C ends it.")
        await stop.wait()
    except PlugError as error:
        raise click.ClickException(str(error)) from error
    finally:
        port.unplug()

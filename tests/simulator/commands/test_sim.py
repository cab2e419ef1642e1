# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge sim` as a process: flight controllers on a pseudo-terminal and on a socket."""

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import serial
from click.testing import CliRunner

from protocols.msp.frame import MspFrame, MspParser, request
from protocols.msp.nav import NavAction
from simulator.commands.sim import sim
from tests.support.msp_bench import waypoint
from tests.support.programs import TIMEOUT_S, Board, run_naze_bridge, until

IDENT, VERSION, NAME, GETINFO = (request(command) for command in (100, 3, 2, 20))
#: After this much silence no answer is expected.
SILENCE_S = 1.0
Start = Callable[..., Board]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts simulators, each with a folder of its own."""
    with ExitStack() as stack:

        def started(*options: str, tcp: bool = False) -> Board:
            folder = tmp_path / f"simulator {len(list(tmp_path.iterdir()))}"
            folder.mkdir()
            board = Board(folder, *options, tcp=tcp)
            stack.callback(board.end, signal.SIGKILL)
            board.wait()
            return board

        yield started


def opened(link: Path, baud: int = 115200) -> serial.Serial:
    return serial.Serial(str(link), baud, timeout=0.05, exclusive=True)


def connected(board: Board) -> socket.socket:
    host, _, port = board.fc.removeprefix("tcp:").partition(":")
    return socket.create_connection((host, int(port)), TIMEOUT_S)


def ask(port: serial.Serial | socket.socket, frame: bytes, seconds: float = TIMEOUT_S) -> MspFrame | None:
    """Ask once; None after this many seconds of real time, ConnectionError if disconnected."""
    parser, deadline = MspParser(), time.monotonic() + seconds
    if isinstance(port, socket.socket):
        port.settimeout(0.05)
        port.sendall(frame)
    else:
        port.write(frame)
    while time.monotonic() < deadline:
        if frames := parser.feed(port.read(4096) if isinstance(port, serial.Serial) else received(port)):
            return frames[0]
    return None


def received(client: socket.socket) -> bytes:
    try:
        data = client.recv(4096)
    except TimeoutError:
        return b""
    if not data:
        raise ConnectionError
    return data


def test_the_port_answers_at_the_boards_speed_only(start: Start) -> None:
    board = start("--kind", "multiwii", "--baud", "57600")
    assert board.printed == f"Simulated MultiWii at {board.link}, 57600 baud. Ctrl-C ends it.\n"
    with opened(board.link, 57600) as port:
        answer = ask(port, IDENT)
        assert answer is not None
        assert answer.payload[0] == 241
        port.baudrate = 115200
        assert ask(port, IDENT, SILENCE_S) is None
        port.baudrate = 57600
    naze = start("--baud", "57600")
    with opened(naze.link) as port:
        assert ask(port, IDENT, SILENCE_S) is None
        port.baudrate = 57600
        # Bytes received at the wrong speed may have begun a frame; the receiver drops it after a while.
        until(lambda: ask(port, IDENT, SILENCE_S), "an answer")


def test_the_speed_changes_with_arming(start: Start) -> None:
    board = start("--tele-prot", "3")
    with opened(board.link) as port:
        assert ask(port, IDENT) is not None
        board.set("armed 1")
        until(lambda: board.stats()["baud"] == 57600, "the speed of an armed board")
        port.baudrate = 57600
        port.reset_input_buffer()
        until(lambda: b"\xfe\x1c" in port.read(200), "an attitude")


def test_a_bad_control_line_is_an_error(start: Start) -> None:
    board = start()
    assert board.line("bit_error_rate much") == "error: bit_error_rate takes a number, not 'much'"
    assert board.line("boxes inf") == "error: boxes takes a number, not 'inf'"
    assert board.line("sing") == "error: unknown line 'sing'"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly(start: Start, number: signal.Signals) -> None:
    board = start()
    assert board.end(number) == 0
    assert [file.name for file in board.link.parent.iterdir()] == ["board.log"]


def test_a_second_client_waits_for_the_turn(start: Start) -> None:
    board = start("--kind", "inav", "--inav-version", "8.0.1", tcp=True)
    assert board.printed == f"Simulated INAV 8.0.1 at {board.fc.removeprefix('tcp:')}. Ctrl-C ends it.\n"
    with connected(board) as first, connected(board) as second:
        answer = ask(first, VERSION)
        assert answer is not None
        assert answer.payload == bytes((8, 0, 1))
        assert ask(second, NAME, 0.3) is None
        first.close()
        # Now the first request is answered.
        answer = ask(second, VERSION)
        assert answer is not None
        assert answer.payload == b"INAV"


def test_after_a_crash_the_port_is_gone_until_a_power_cycle(start: Start) -> None:
    board = start("--kind", "inav", tcp=True)
    with connected(board) as client:
        ask(client, request(209, waypoint(1).pack(1)))
        ask(client, request(209, waypoint(action=NavAction.JUMP, p1=0).pack(2)))
        with pytest.raises(ConnectionError):
            ask(client, GETINFO)
    with pytest.raises(ConnectionRefusedError):
        connected(board)
    assert board.stats()["power"] == "CRASHED"
    board.set("power off")
    board.set("power on")
    # During boot nothing is received.
    with connected(board) as client:
        answer = until(lambda: ask(client, GETINFO, 0.5), "an answer")
        assert answer.payload == bytes((0, 120, 0, 0))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--link {}/none/naze", "Error: {}/none/naze cannot be created: No such file or directory\n"),
        ("--link {}/file", "Error: {}/file already exists: use another --link, or remove it\n"),
        ("--link {}/link", "Error: {}/link already exists: use another --link, or remove it\n"),
        ("--link {}/naze --control {}/none/socket", "Error: {}/none/socket cannot be created: "),
        ("--link {}/naze --state {}/none/flash", "Error: the state file {}/none/flash cannot be used: "),
        ("--link {}/naze --state {}/file", "Error: the state file {}/file has 4 bytes, but this board's"),
        ("--kind inav --tcp 127.0.0.1:5760 --state {}/file", "name another file"),
        ("--kind inav", "--link PATH or --tcp HOST:PORT"),
        ("--tcp 5760", "'5760' is not HOST:PORT"),
        ("--kind inav --tcp 127.0.0.1:1 --tele-prot 1", "--tele-prot has no effect with --kind inav"),
        ("--tcp 127.0.0.1:1 --speed 4", "--speed has no effect with a board that does not fly"),
        ("--kind inav --tcp 192.0.2.1:5760", "192.0.2.1:5760 cannot be opened for listening"),
    ],
)
def test_obstacles_at_start_are_reported_in_one_sentence(tmp_path: Path, options: str, says: str) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to("file")
    done = CliRunner().invoke(sim, options.replace("{}", str(tmp_path)).split())
    assert done.exit_code != 0
    assert says.replace("{}", str(tmp_path)) in done.stderr
    assert (tmp_path / "link").readlink() == Path("file")
    assert (tmp_path / "file").read_text() == "mine"


def test_a_port_in_use_is_named_with_the_remedy(start: Start) -> None:
    address = start("--kind", "inav", tcp=True).fc.removeprefix("tcp:")
    second = run_naze_bridge("sim", "--kind", "inav", "--tcp", address)
    why = f"{address} cannot be opened for listening: Address already in use; give another port"
    assert (second.returncode, second.stderr) == (1, f"naze-bridge: {why}\n")


# -- the link to the pseudo-terminal -------------------------------------------------------------------------


def test_the_link_of_a_killed_simulator_is_replaced(start: Start) -> None:
    killed = start()
    killed.end(signal.SIGKILL)
    assert os.path.islink(killed.link)
    start("--link", str(killed.link))
    with opened(killed.link) as port:
        assert ask(port, IDENT) is not None


def test_a_link_older_than_the_terminal_behind_it_is_replaced(start: Start) -> None:
    other = start()
    stale = other.link.with_name("stale")
    # The kernel gave the number of a killed simulator's terminal to this one.
    stale.symlink_to(other.link.readlink())
    os.utime(stale, (0, 0), follow_symlinks=False)
    start("--link", str(stale))
    with opened(stale) as port:
        assert ask(port, IDENT) is not None
    assert stale.readlink() != other.link.readlink()


def test_a_link_taken_over_by_another_simulator_is_not_removed(start: Start) -> None:
    first = start()
    first.link.unlink()
    start("--link", str(first.link))
    terminal = first.link.readlink()
    assert first.end() == 0
    assert first.link.readlink() == terminal


def test_the_link_of_a_running_simulator_is_not_replaced(start: Start) -> None:
    link = start().link
    with opened(link) as port:
        # Checking the lock does not release it.
        for _ in range(2):
            second = run_naze_bridge("sim", "--link", link)
            assert second.returncode == 1
            assert f"{link} belongs to a running simulator" in second.stderr
        assert ask(port, IDENT) is not None

# SPDX-License-Identifier: GPL-3.0-or-later
"""Each row of the table of faults: the printed action, carried out on the faulty file or machine, removes the fault.

The machine's rows are in tests/support/machine_faults.py.
"""

import asyncio
import errno
import io
import re
import shlex
import socket
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from unittest.mock import MagicMock

import pytest
from click.testing import CliRunner

from protocols.mission_file import write_mission_file
from protocols.mission_item import MissionItem
from protocols.remedies import Fault
from protocols.settings_file import read_settings_file
from service.cli.main import main
from service.cli.setup import command
from service.cli.setup.change import Machine, SetupError
from service.cli.setup.command import check_answers
from service.links.gcs_links import open_link
from service.settings.addresses import parse_fc, parse_gcs
from service.settings.write_access import read_passphrase
from terminal import files
from tests.service.cli.test_mission_commands import assert_one_sentence
from tests.support.faulty_machine import FaultyMachine
from tests.support.machine_faults import MACHINE, OTHERS, Faulty, Make, Trial
from tests.support.programs import free_port, run_naze_bridge
from tests.support.setup_pi import Pi

WPL = "QGC WPL 110\n"
HOME = "0\t1\t0\t16\t0\t0\t0\t0\t51.477\t0.001\t46\t1\n"
TAKEOFF = "0\t0\t3\t22\t0\t0\t0\t0\t51.4771\t0.0012\t10\t1\n"
POINT = "1\t0\t3\t16\t0\t0\t0\t0\t51.4771\t0.0012\t15\t1\n"
GOOD = WPL + HOME + POINT
ITEM = '<missionitem no="1" action="WAYPOINT" lat="51.4771" lon="0.0012" alt="15"/>'
XML = f"<mission>{ITEM}</mission>"
KML = "<kml><LineString><altitudeMode>absolute</altitudeMode><coordinates>{}</coordinates></LineString></kml>"
PATH = KML.format("0.0012,51.4771,15")
TABLE = "latitude,longitude,altitude(m)\n51.4771,0.0012,15\n"
PLAN = (
    '{"fileType": "Plan", "version": 1, "mission": {"version": 2, "plannedHomePosition": [51.477, 0.001, 46], '
    '"items": [{"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, 0, 51.4771, 0.0012, 15]}]}}'
)
WP_LINE = "wp 0 1 514771000 12000 1500 0 0 0 165\n"


def said_by(*words: object) -> str:
    """The output of a command, or empty if it is done."""
    done = CliRunner().invoke(main, [str(word) for word in words])
    return "" if done.exit_code == 0 else " ".join(done.output.split())


def mission(name: str, faulty_text: str | bytes, mended: str) -> Make:
    """A mission file, and the file after a person did what was asked."""

    def make(faulty: Faulty) -> Trial:
        file = faulty.folder / name
        file.write_bytes(faulty_text if isinstance(faulty_text, bytes) else faulty_text.encode())
        return Trial(lambda: said_by("check", file), lambda _: file.write_text(mended))

    return make


def settings(faulty_text: str, mended: str = "A,2\n") -> Make:
    """The same for a file of settings."""

    def make(_: Faulty) -> Trial:
        held = [faulty_text]
        return Trial(
            lambda: error_of(lambda: read_settings_file(held[0].encode(), "x")),
            lambda _: held.append(held.pop() and mended),
        )

    return make


def words(parse: Callable[[str], object], given: str, suggested: str) -> Make:
    """A text that a person gives, and the pattern of a better one in the sentence."""

    def make(_: Faulty) -> Trial:
        held = [given]
        return Trial(
            lambda: error_of(lambda: parse(held[-1])), lambda said: held.append(re.findall(suggested, said)[0])
        )

    return make


def instead(parse: Callable[[str], object], given: str, better: str) -> Make:
    """The same if the sentence only describes it."""

    def make(_: Faulty) -> Trial:
        held = [given]
        return Trial(lambda: error_of(lambda: parse(held[-1])), lambda _: held.append(better))

    return make


def error_of(call: Callable[[], object]) -> str:
    try:
        call()
    except Exception as error:
        return str(getattr(error, "message", error))
    return ""


def commands(faulty_words: str, mended: str) -> Make:
    """A command with a file good.waypoints, and the better command. {}: the folder."""

    def make(faulty: Faulty) -> Trial:
        (faulty.folder / "good.waypoints").write_text(GOOD)
        (faulty.folder / "takeoff.waypoints").write_text(WPL + TAKEOFF + POINT)
        (faulty.folder / "d.waypoints").mkdir()
        held = [faulty_words]
        return Trial(lambda: said_by(*held[-1].format(faulty.folder).split()), lambda _: held.append(mended))

    return make


def saved_value(faulty: Faulty) -> Trial:
    file, dump = faulty.folder / "good.waypoints", faulty.folder / "dump.txt"
    file.write_text(GOOD)
    dump.write_text("set nav_rth_alt_mode = X\n")
    check = ("check", "--kind", "inav", "--settings", dump, file)
    return Trial(lambda: said_by(*check), lambda _: dump.write_text("set nav_rth_alt_mode = EXTRA\n"))


def without_altitude(faulty: Faulty) -> Trial:
    """The printed command makes a mission of the path."""
    file, target = faulty.folder / "path.kml", faulty.folder / "MISSION.waypoints"
    file.write_text(KML.replace("absolute", "clampToGround").format("0.0012,51.4771,0"))

    def obey(said: str) -> None:
        (named,) = re.findall(r"`naze-bridge (convert .*)`", said)
        assert said_by(*named.replace("METRES", "15").replace("MISSION.waypoints", str(target)).split()) == ""

    return Trial(lambda: said_by("check", target if target.exists() else file), obey)


def full_disk(faulty: Faulty) -> Trial:
    (faulty.folder / "good.waypoints").write_text(GOOD)

    def replace_file(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    faulty.monkeypatch.setattr(files, "replace_file", replace_file)
    convert = ("convert", faulty.folder / "good.waypoints", faulty.folder / "out.plan")
    return Trial(lambda: said_by(*convert), lambda _: faulty.monkeypatch.undo())


def link(
    address: Callable[[], str], better: Callable[[], str], prepare: Callable[[Faulty], object] = lambda _: None
) -> Make:
    """A link that cannot be opened, and the address to open instead."""

    async def opened(text: str) -> None:
        open_link(parse_gcs(text), MagicMock()).close()

    def make(faulty: Faulty) -> Trial:
        held = [address()]
        prepare(faulty)
        return Trial(lambda: error_of(lambda: asyncio.run(opened(held[-1]))), lambda _: held.append(better()))

    return make


def occupied(faulty: Faulty) -> Trial:
    """The program that has the port is stopped."""
    port = free_port(socket.SOCK_STREAM)
    taken = socket.create_server(("127.0.0.1", port))
    trial = link(lambda: f"tcpin:127.0.0.1:{port}", lambda: f"tcpin:127.0.0.1:{port}")(faulty)

    def obey(said: str) -> None:
        trial.obey(said)
        taken.close()

    return Trial(trial.says, obey)


def low_ports_of_root(faulty: Faulty) -> None:
    bind = socket.socket.bind

    def as_a_user(self: socket.socket, place: tuple[str, int]) -> None:
        if place[1] < 1024:
            raise PermissionError(errno.EACCES, "Permission denied")
        bind(self, place)

    faulty.monkeypatch.setattr("socket.socket.bind", as_a_user, raising=False)


def key_file(text: bytes, obey: Callable[[Path, str], object], mode: int = 0o600) -> Make:
    def make(faulty: Faulty) -> Trial:
        file = faulty.folder / "gcs.key"
        file.write_bytes(text)
        file.chmod(mode)
        return Trial(lambda: error_of(lambda: read_passphrase(file)), lambda said: obey(file, said))

    return make


def rewritten(file: Path, _said: str) -> None:
    file.write_text("some words for a key\n")


def run_printed(_file: Path, said: str) -> None:
    (printed,) = re.findall(r"run (chmod \S+ \S+)", said)
    subprocess.run(shlex.split(printed), check=True)


def setup(faulty_words: str, mended: str, prepare: Callable[[Faulty, Pi], object] = lambda _faulty, _pi: None) -> Make:
    """`naze-bridge setup` with these words. {}: a folder with files of one line, none and binary."""

    def make(faulty: Faulty) -> Trial:
        pi, held = Pi(faulty.pi.root, faulty.monkeypatch), [faulty_words]
        for name, text in (("good", b"long-enough-1\n"), ("binary", b"\xff\xfe"), ("two", b"a\nb\n")):
            (faulty.folder / name).write_bytes(text)
        prepare(faulty, pi)

        def says() -> str:
            return " ".join(pi.setup(*held[-1].format(faulty.folder).split()).output.split())

        return Trial(says, lambda _: held.append(mended))

    return make


def as_a_user(faulty: Faulty, _pi: Pi) -> None:
    faulty.monkeypatch.setattr(command, "is_root", lambda: False)


def token(faulty: Faulty) -> Trial:
    pi = Pi(faulty.pi.root, faulty.monkeypatch)
    file = pi.root / "var/lib/naze-bridge/web-token"

    def obey(said: str) -> None:
        assert "`sudo naze-bridge setup --page`" in said
        assert pi.setup("--yes", "--page").exit_code == 0
        assert "web" in pi.settings()
        file.parent.mkdir(parents=True)
        file.write_text("2345-6789-abcd\n")  # as the daemon that serves the page

    return Trial(lambda: said_by("token", "--root", pi.root), obey)


def token_as_a_user(faulty: Faulty) -> Trial:
    pi = Pi(faulty.pi.root, faulty.monkeypatch)
    faulty.monkeypatch.setattr(command, "is_root", lambda: False)
    return Trial(
        lambda: said_by("token", "--root", pi.root),
        lambda _: faulty.monkeypatch.setattr(command, "is_root", lambda: True),
    )


def failing_change(faulty: Faulty) -> Trial:
    pi = Pi(faulty.pi.root, faulty.monkeypatch)
    run = Machine.run

    def refused(_machine: Machine, words: tuple[str, ...], *_args: object) -> str:
        raise SetupError(f"`{' '.join(words)}` failed: the unit is masked")

    faulty.monkeypatch.setattr(Machine, "run", refused)
    says = lambda: " ".join(pi.setup("--yes").output.split())  # noqa: E731
    return Trial(says, lambda _: faulty.monkeypatch.setattr(Machine, "run", run))


def shadowed(faulty: Faulty, pi: Pi) -> None:
    faulty.known = pi.root / "etc/naze-bridge/config.toml"
    faulty.known.parent.mkdir(parents=True, exist_ok=True)
    faulty.known.write_text('fc = "/dev/ttyUSB3"\n')


def shadowed_answer(faulty: Faulty) -> Trial:
    trial = setup("--yes --fc /dev/ttyUSB0", "--yes --fc /dev/ttyUSB0", shadowed)(faulty)
    return Trial(trial.says, lambda said: faulty.known.write_text("") if "config.toml:1 sets fc" in said else None)


def no_card(faulty: Faulty, pi: Pi) -> None:
    (pi.root / "run/systemd/system").mkdir(parents=True)
    (pi.root / "sys/class/net/wlan0/wireless/x").unlink()
    (pi.root / "sys/class/net/wlan0/wireless").rmdir()


def zipped(name: str) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr(name, PATH)
    return data.getvalue()


def pulled_as(name: str) -> str:
    return write_mission_file([MissionItem(0, 16, 0, 0, 0, 0, 0, 514770000, 10000, 46)], name)


_HOTSPOT = "--yes --hotspot kite --country DE --password-file {}/good"
TRIALS: dict[Fault, Make] = {
    Fault.STRANGE_FILE: mission("a.txt", "hello\n", GOOD),
    Fault.OTHER_FILE: mission("a.bin", b"\xa3\x95\x80\x80", GOOD),
    Fault.WEB_PAGE: mission("a.plan", "<!DOCTYPE html>\n<html></html>\n", PLAN),
    Fault.OTHER_PLAN: mission("a.waypoints", "RALLY\t51.4\t0.1\t20\t0\t0\t0\n", GOOD),
    Fault.SETTINGS_FOR_MISSION: mission("a.txt", "set p_roll = 4\n", GOOD),
    Fault.NO_HEADER: mission("a.txt", HOME + POINT, GOOD),
    Fault.UNKNOWN_HEADER: mission("a.txt", GOOD.replace("110", "130"), GOOD),
    Fault.NO_TITLES: mission("a.csv", "Breite;Länge;Höhe\n51.4771;0.0012;15\n", TABLE),
    Fault.UNKNOWN_XML: mission("a.xml", "<osm></osm>", XML),
    Fault.LONG_XML: mission("a.kml", PATH + " " * 2**21, PATH),
    Fault.DOCUMENT_TYPE: mission("a.mission", f'<!DOCTYPE m SYSTEM "http://localhost/x">\n{XML}', XML),
    Fault.DAMAGED_FILE: mission("a.mission", XML[:40], XML),
    Fault.NO_ITEMS: mission("a.waypoints", WPL, GOOD),
    Fault.TRUNCATED_LINE: mission("a.waypoints", GOOD[:-20], GOOD),
    Fault.DECIMAL_COMMA: mission("a.waypoints", WPL + (HOME + POINT).replace(".", ","), GOOD),
    Fault.NOT_A_NUMBER: mission("a.waypoints", GOOD.replace("\t15\t", "\tx\t"), GOOD),
    Fault.NOT_WHOLE: mission("a.waypoints", GOOD.replace("1\t0\t3\t16", "1\t0\t-1\t16"), GOOD),
    Fault.OUT_OF_RANGE: mission("a.mission", XML.replace("/>", ' parameter1="99999"/>'), XML),
    Fault.NOT_DEGREES: mission("a.waypoints", GOOD.replace("51.4771", "1e305"), GOOD),
    Fault.UNKNOWN_ACTION: mission("a.mission", XML.replace("WAYPOINT", "FLY"), XML),
    Fault.NOT_A_WP_LINE: mission("a.txt", "wp 0 1 51.4771 0.0012 15 0 0 0 165\n", WP_LINE),
    Fault.MANY_MISSIONS: mission("a.txt", WP_LINE + WP_LINE.replace("wp 0", "wp 1"), WP_LINE),
    Fault.MANY_PATHS: mission("a.kml", f"<kml>{PATH[5:-6]}{PATH[5:-6]}</kml>", PATH),
    Fault.NO_PATH: mission("a.kml", "<kml></kml>", PATH),
    Fault.NO_ALTITUDE: without_altitude,
    Fault.NOT_A_PLACE: mission("a.kml", KML.format("0.0012, 51.4771, 15"), PATH),
    Fault.NO_KML: mission("a.kmz", zipped("a.txt"), PATH),
    Fault.SAME_TITLES: mission("a.csv", TABLE.replace("altitude(m)", "latitude"), TABLE),
    Fault.UNEQUAL_ROW: mission("a.csv", TABLE.replace("51.4771", "51,4771"), TABLE),
    Fault.PLAN_VERSION: mission("a.plan", PLAN.replace('"version": 1', '"version": 7'), PLAN),
    Fault.NOT_A_PLAN: mission("a.plan", PLAN[:-3], PLAN),
    Fault.SURVEY_WITHOUT_ITEMS: mission("a.plan", PLAN.replace("SimpleItem", "ComplexItem"), PLAN),
    Fault.FOREIGN_ENDING: instead(pulled_as, "a.kml", "a.waypoints"),
    Fault.UNKNOWN_ENDING: commands("convert {0}/good.waypoints {0}/a.kml", "convert {0}/good.waypoints {0}/a.plan"),
    Fault.OWN_ALTITUDES: commands(
        "convert {0}/good.waypoints {0}/a.plan --alt 20", "convert {0}/good.waypoints {0}/a.plan"
    ),
    Fault.MISSION_FOR_SETTINGS: settings(WPL),
    Fault.NO_SETTINGS: settings("<html></html>\n"),
    Fault.BAD_COMMAND: settings("set nav_rth_altitude 2000\n", "set nav_rth_altitude = 2000\n"),
    Fault.NOT_A_SETTING: settings("WP_RADIUS,2,5\n", "WP_RADIUS,2.5\n"),
    Fault.NOT_A_NAME: settings("Größe,2\n", "SIZE,2\n"),
    Fault.NOT_A_VALUE: settings("WP_RADIUS,two\n", "WP_RADIUS,2\n"),
    Fault.TWO_VALUES: settings("A,1\nA,2\n"),
    Fault.MANY_SETTINGS: settings("".join(f"A{number},1\n" for number in range(1501))),
    Fault.LONG_SETTINGS: settings("A,1\n" + "#" * 2**20),
    Fault.UNREADABLE_FILE: commands("check {0}/absent.waypoints", "check {0}/good.waypoints"),
    Fault.FULL_DISK: full_disk,
    Fault.NO_FILE: commands("convert {0}/good.waypoints {0}/d.waypoints", "convert {0}/good.waypoints {0}/e.waypoints"),
    Fault.NOT_AN_FC: words(parse_fc, "ttyUSB0", r"did you mean (\S+)\?"),
    Fault.NOT_A_GCS: words(parse_gcs, "udpinn:0.0.0.0:14550", r"did you mean (\S+)\?"),
    Fault.NOT_A_BAUD: instead(parse_fc, "/dev/ttyUSB0,fast", "/dev/ttyUSB0"),
    Fault.NO_RADIO_SPEED: words(parse_gcs, "/dev/ttyUSB1", r"as in (\S+)"),
    Fault.SENT_OR_HEARD: words(parse_gcs, "udp:192.168.4.20:14550", r"write (\S+) to send"),
    Fault.NO_BRACKETS: words(lambda text: parse_fc(f"tcp:{text}"), "::1:5760", r"as in (\S+)"),
    Fault.NO_PORT: instead(parse_gcs, "udpin:", "udpin:0.0.0.0:14550"),
    Fault.NOT_A_PORT: instead(parse_gcs, "udpin:0.0.0.0:99999", "udpin:0.0.0.0:14550"),
    Fault.NOT_A_HOST: instead(parse_fc, "tcp:a..b:5760", "tcp:a.b:5760"),
    Fault.LINK_IN_USE: occupied,
    Fault.LINK_ELSEWHERE: link(lambda: "udpin:192.0.2.1:14550", lambda: f"udpin:0.0.0.0:{free_port()}"),
    Fault.LINK_OF_ROOT: link(
        lambda: "udpin:127.0.0.1:145", lambda: f"udpin:127.0.0.1:{free_port()}", low_ports_of_root
    ),
    Fault.UNKNOWN_HOST: link(lambda: "udpin:pi.invalid:14550", lambda: f"udpin:127.0.0.1:{free_port()}"),
    Fault.KEY_FILE_OPEN: key_file(b"some words for a key\n", run_printed, 0o644),
    Fault.KEY_FILE_LINES: key_file(b"two\nlines\n", rewritten),
    Fault.NOT_ROOT: setup("", "--dry-run", as_a_user),
    Fault.TOKEN_NOT_ROOT: token_as_a_user,
    Fault.NO_TOKEN: token,
    Fault.TWO_KEYS: setup("--yes --new-key --key-file {}/good", "--yes --key-file {}/good"),
    Fault.NO_HOTSPOT_CARD: setup(_HOTSPOT, "--yes", no_card),
    Fault.NO_PASSWORD: setup("--yes --hotspot kite --country DE", _HOTSPOT),
    Fault.NOT_AN_SSID: setup(_HOTSPOT.replace("kite", "k" * 33), _HOTSPOT),
    Fault.NOT_A_PASSWORD: instead(lambda text: check_answers("kite", text, "DE", None), "short", "long-enough"),
    Fault.NOT_A_COUNTRY: setup(_HOTSPOT.replace("DE", "Germany"), _HOTSPOT),
    Fault.NOT_A_HOST_NAME: setup("--yes --name my_pi", "--yes --name my-pi"),
    Fault.SECRET_LINES: setup("--yes --key-file {}/two", "--yes --key-file {}/good"),
    Fault.SHADOWED_ANSWER: shadowed_answer,
    Fault.FAILED_CHANGE: failing_change,
    Fault.SETTINGS_OF_OTHERS: commands("check --settings {0}/x.param {0}/good.waypoints", "check {0}/good.waypoints"),
    Fault.BAD_SAVED_VALUE: saved_value,
    Fault.HOME_MISSING: commands("check {0}/takeoff.waypoints", "check --home 51.477,0.001 {0}/takeoff.waypoints"),
    **MACHINE,
}


def pattern(fault: Fault) -> re.Pattern[str]:
    """The sentence and the action with any values."""
    return re.compile(".*".join(re.sub(r"\\\{.*?\\\}", ".*", re.escape(part)) for part in fault.value))


@pytest.mark.parametrize(("fault", "make"), [*((fault, TRIALS.get(fault)) for fault in Fault), *OTHERS])
def test_the_action_removes_the_fault(
    fault: Fault, make: Make | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert make is not None, "this row of the table has no trial"
    trial = make(Faulty(tmp_path, monkeypatch, FaultyMachine(tmp_path / "root")))
    said = trial.says()
    assert pattern(fault).search(said), said
    trial.obey(said)
    assert not pattern(fault).search(trial.says()), trial.says()


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (["check"], "see `naze-bridge check --help`"),
        (["status", "--config", "x"], "see `naze-bridge status --help`"),
        (["pull", "a", "b"], "see `naze-bridge pull --help`"),
        (["chek", "x"], "did you mean 'check'?"),
        (["settings", "lst"], "did you mean 'list'?"),
    ],
)
def test_a_mistake_on_the_command_line_gets_one_sentence(words: list[str], remedy: str) -> None:
    assert_one_sentence(run_naze_bridge(*words), 2, remedy)

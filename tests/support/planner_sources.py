# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission Planner's own link, state and handlers of its windows, compiled by mono's mcs for a session without a screen.

The sources are in the folder that MISSION_PLANNER names (tests/real_mission_planner/sources.txt). What mcs does not
understand (C# 8, Span, named tuples inside generics) is adapted or left out here. Commit a2fcd74d6 compiles.
"""

import re
import subprocess
from pathlib import Path
from xml.etree import ElementTree

_HARNESS = Path(__file__).parents[1] / "real_mission_planner"
#: Members that mcs cannot compile, or that need a library which a session does not use.
_LEFT_OUT = {
    "PointLatLngAlt.cs": r"Geo|UTM|MGRS|Coordinate|ctfac|coordtrans|FriendlyZone|FromZone",
    "Extensions.cs": r"Span|JSON|ToSizeUnits|EvaluateMath|Compress|CommsFile|Windowed|AddRange",
    "PacketInspector.cs": r"SeenSysid|SeenCompid",
    "Utils.cs": r"inverse|nxn",
}
_EDITS = {
    "PointLatLngAlt.cs": [(r"using (Geo|Proj).*", "")],
    "MAVLinkInterface.cs": [
        (r"case MAV_TYPE n when .*", ""),
        (r"\(MAVLINK_MSG_ID( msgId)?, Func<MAVLinkMessage, bool>[^)]*byte( compid)?\)", "Subscription"),
        (
            r"var item = \(msgid, function, exclusive, sysid, compid\)",
            "var item = new Subscription { msgId = msgid, function = function, sysid = sysid, compid = compid }",
        ),
        (r"item\.msgid", "item.msgId"),
        (r"_OnPacketReceived.GetInv.*ForEach.*", ""),
    ],
    "MAVFtp.cs": [(r"sendlist\.Take\(5\)\.ForEach", "sendlist.Take(5).ToList().ForEach")],
    "parampck.cs": [
        (r"out \(int type_len, char type_format\) mapped", "out var mapped"),
        (r"mapped\.type_len", "mapped.Item1"),
        (r"mapped\.type_format", "mapped.Item2"),
    ],
}
_BUTTONS = (
    r"actions|BUTactiondo_Click|BUTrestartmission_Click"
    r"|BUT_(ARM|setmode|setwp|resumemis|abortland|quickauto|quickrtl)_Click"
    r"|modifyandSet(Alt|Speed)_Click"
    r"|(goHere|flyToHereAlt|pointCameraHere|setHomeHere|setEKFHomeHere|triggerCamera|takeOff)ToolStripMenuItem_Click"
)
#: The windows: source, and the members that a session uses, unchanged.
_WINDOWS = {
    "MissionPlanner.MainV2": ("MainV2.cs", "SerialReader"),
    "MissionPlanner.GCSViews.FlightData": (
        "GCSViews/FlightData.cs",
        _BUTTONS,
    ),
    "MissionPlanner.GCSViews.FlightPlanner": ("GCSViews/FlightPlanner.cs", "saveWPs|saveWPsFast|getWPs"),
    "MissionPlanner.GCSViews.ConfigAccelerometerCalibration": (
        "GCSViews/ConfigurationView/ConfigAccelerometerCalibration.cs",
        "BUT_calib_accell_Click|receivedPacket|UpdateUserMessage|BUT_level_Click|BUT_simpleAccelCal_Click",
    ),
    "MissionPlanner.GCSViews.ConfigHWCompass2": (
        "GCSViews/ConfigurationView/ConfigHWCompass2.cs",
        "BUT_OBmagcal(start|accept|cancel)_Click|ReceviedPacket|timer1_Tick",
    ),
    "MissionPlanner.GCSViews.PrearmStatus": (
        "Controls/PrearmStatus.cs",
        "requestchecktimer_Tick|updatetexttimer_Tick",
    ),
}
_USINGS = """
using System; using System.Collections; using System.Collections.Generic; using System.Globalization; using System.IO;
using System.Linq; using System.Reflection; using System.Text; using System.Threading; using System.Threading.Tasks;
using MissionPlanner.ArduPilot; using MissionPlanner.ArduPilot.Mavlink; using MissionPlanner.Comms;
using MissionPlanner.Utilities; using Newtonsoft.Json;
"""
_LIBRARIES = (
    "System.Core,System.ComponentModel.DataAnnotations,System.Drawing,System.Management,System.Net.Http,"
    "System.Numerics,System.Reactive.Core,System.Reactive.Interfaces,System.Reactive.Linq,"
    "System.Runtime.Serialization,System.Web,System.Xml,System.Xml.Linq,Microsoft.CSharp,Mono.Posix"
)


def compile_planner(planner: Path, folder: Path) -> Path:
    """Compile the sources at `planner` together with the harness; return the program."""
    for pattern in (_HARNESS / "sources.txt").read_text().split():
        for file in (planner / "ExtLibs").glob(pattern):
            (folder / file.name).write_text(_adapted(file.name, _text(file)))
    (folder / "Handlers.cs").write_text(_handlers(planner))
    (folder / "Strings.cs").write_text(_strings(planner / "ExtLibs/Strings/Strings.resx"))
    program = folder / "planner.exe"
    sources = [*sorted(folder.glob("*.cs")), *sorted(_HARNESS.glob("*.cs"))]
    command = ["mcs", "-langversion:latest", "-unsafe", "-warn:0", f"-r:{_LIBRARIES}", f"-out:{program}"]
    done = subprocess.run([*command, *map(str, sources)], capture_output=True, text=True, check=False)
    assert program.exists(), done.stdout + done.stderr
    return program


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8-sig").replace("\r\n", "\n")


def _adapted(name: str, text: str) -> str:
    text = re.sub(r"\b(\w+) is null\b", r"(object)\1 == null", text)
    for pattern, replacement in _EDITS.get(name, []):
        text = re.sub(pattern, replacement, text)
    for member in _members(text, _LEFT_OUT[name]) if name in _LEFT_OUT else []:
        text = text.replace(member, "")
    return text


def _members(text: str, pattern: str) -> list[str]:
    """The text of each member of a class (at its indentation of 8) whose first line matches."""
    found = []
    lines = text.split("\n")
    for at, line in enumerate(lines):
        if re.match(r" {8}(public|private|internal|protected|static) ", line) and re.search(pattern, line):
            end, depth, is_open = at, 0, False
            while not (depth == 0 and end > at and (is_open or lines[end - 1].rstrip().endswith(";"))):
                depth += lines[end].count("{") - lines[end].count("}")
                is_open = is_open or "{" in lines[end]
                end += 1
            found.append("\n".join(lines[at:end]))
    return found


def _handlers(planner: Path) -> str:
    parts = [_USINGS]
    for window, (file, wanted) in _WINDOWS.items():
        namespace, _, name = window.rpartition(".")
        members = _members(_text(planner / file), rf"(void|bool|enum) ({wanted})\b")
        parts.append(f"namespace {namespace} {{ public partial class {name} {{\n" + "\n".join(members) + "\n} }")
    return "\n".join(parts)


def _strings(resources: Path) -> str:
    """The English texts as constants."""
    found = ElementTree.parse(resources).iter("data")  # noqa: S314
    texts = {each.attrib["name"]: (each.findtext("value") or "").replace('"', '""') for each in found}
    lines = [f'public const string {name} = @"{text}";' for name, text in texts.items()]
    return "namespace MissionPlanner { public class Strings {\n" + "\n".join(lines) + "\n} }"

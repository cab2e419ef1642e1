# SPDX-License-Identifier: GPL-3.0-or-later
"""QGroundControl's own vehicle, plan and parameter managers, compiled with Qt 6 for a session without a screen.

The sources are in the folder that QGROUNDCONTROL names (tests/real_qgroundcontrol/sources.txt). Each of their headers
that is not in that list is replaced by StandIns.h. Commit c15cc3204 compiles with Debian's Qt 6.4.
"""

import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_HARNESS = Path(__file__).parents[1] / "real_qgroundcontrol"
_MODULES = ("Qt6Network", "Qt6Positioning", "Qt6Qml", "Qt6Gui", "Qt6StateMachine")
#: Qt 6.4 lacks these of Qt 6.5.
_EDITS = {
    "JsonHelper.cc": [("QApplicationStatic", "QGlobalStatic"), ("Q_APPLICATION_STATIC", "Q_GLOBAL_STATIC")],
    "QGC.h": [("QtCore/QtTypes", "QtCore/QtGlobal")],
    "Vehicle.cc": [
        (r"_eventHandler\(message.compid\).*", ""),
        (r".*QMetaObject::invokeMethod\(_imageProtocolManager.*", ""),
        (r"controlStatus\.sysid_in_control", "0"),
    ],
}
#: Functions that need a library which a session does not use.
_LEFT_OUT = {
    "Vehicle.cc": r"Vehicle::(_handleEvent|_eventHandler|setEventsMetadata)\(",
    "APMFirmwarePlugin.cc": r"APMFirmwarePlugin::startCompensatingBaro\(",
    "MissionItem.cc": r"MissionItem::(load|save|_convertJson\w+)\(",
    "GeoFenceManager.cc": r"GeoFenceManager::sendToVehicle\(",
}


def compile_qgc(sources: Path, mavlink: Path, folder: Path) -> Path:
    """Compile the sources together with the harness; return the program. mavlink: MAVLink's C headers."""
    for pattern in (_HARNESS / "sources.txt").read_text().split():
        for file in (sources / "src").glob(pattern):
            (folder / file.name).write_text(_adapted(file.name, file.read_text(encoding="utf-8")))
    for file in _HARNESS.glob("*.[hc]*"):
        (folder / file.name).write_text(file.read_text())
    for name in _missing_headers(folder):
        (folder / name).write_text('#pragma once\n#include "StandIns.h"\n')
    _resources(sources, folder)
    _meta_objects(folder)
    flags = ["-std=c++20", "-O0", "-w", "-fPIC", "-DQT_NO_DEBUG", f"-I{folder}", f"-I{mavlink}", f"-I{mavlink}/all"]
    flags += _run("pkg-config", "--cflags", *_MODULES).split()
    _run("g++", *flags, "-x", "c++-header", str(folder / "StandIns.h"))

    def compile_unit(unit: Path) -> str:
        compiled = str(unit.with_suffix(".o"))
        _run("g++", *flags, "-include", "StandIns.h", "-c", str(unit), "-o", compiled)
        return compiled

    with ThreadPoolExecutor(2) as pool:
        objects = list(pool.map(compile_unit, sorted(folder.glob("*.cc"))))
    program = folder / "qgc"
    _run("g++", "-o", str(program), *objects, *_run("pkg-config", "--libs", *_MODULES).split())
    return program


def _meta_objects(folder: Path) -> None:
    """Qt's code for all classes with signals, as one unit: mocs.cc."""
    moc = _run("pkg-config", "--variable=libexecdir", "Qt6Core").strip() + "/moc"
    units = []
    for header in sorted(folder.glob("*.h")):
        if re.search(r"\bQ_(OBJECT|GADGET|NAMESPACE)\b", header.read_text()):
            units.append(f"{header.stem}.moc")
            _run(moc, str(header), "-o", str(folder / units[-1]))
    (folder / "mocs.cc").write_text("".join(f'#include "{unit}"\n' for unit in units))


def _run(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, " ".join(command[:1]) + " " + command[-1] + "\n" + done.stderr[:6000]
    return done.stdout


def _adapted(name: str, text: str) -> str:
    for pattern, replacement in _EDITS.get(name, []):
        text = re.sub(pattern, replacement, text)
    if name in _LEFT_OUT:
        text = re.sub(rf"^\S.*{_LEFT_OUT[name]}[^{{;]*\n{{\n(.*\n)*?}}\n", "", text, flags=re.MULTILINE)
    return text


def _missing_headers(folder: Path) -> set[str]:
    texts = [file.read_text() for file in folder.iterdir() if file.suffix in (".h", ".cc")]
    named = {name for text in texts for name in re.findall(r'(?:#include|Q_MOC_INCLUDE\() *[<"](\w+\.h)[>"]', text)}
    return {name for name in named if name[0].isupper() and not (folder / name).exists()}


def _resources(sources: Path, folder: Path) -> None:
    lines = [
        f'<file alias="Vehicle/{each.name}">{each}</file>' for each in (sources / "src/Vehicle").rglob("*Fact.json")
    ]
    status = folder / "mainStatusText.js"
    status.write_text(_status_script((sources / "src/QmlControls/MainStatusIndicator.qml").read_text()))
    lines.append(f'<file alias="{status.name}">{status}</file>')
    (folder / "json.qrc").write_text('<RCC><qresource prefix="/json">' + "".join(lines) + "</qresource></RCC>")
    rcc = _run("pkg-config", "--variable=libexecdir", "Qt6Core").strip() + "/rcc"
    _run(rcc, str(folder / "json.qrc"), "-o", str(folder / "json.cc"))


def _status_script(qml: str) -> str:
    """The function that makes the text of the toolbar, with the properties that it uses."""
    function = re.search(r"^( *)function mainStatusText\(\) {\n(.*\n)*?\1}\n", qml, re.MULTILINE)
    assert function
    texts = re.findall(r'property string (\w+): *qsTr\((".*")\)', qml)
    label = ", ".join(f"{name}: {text}" for name, text in texts)
    return f"""
        var mainStatusLabel = {{ {label} }}, qgcPal = {{}}, _healthAndArmingChecksSupported = false;
        var _activeVehicle, _communicationLost, _mainStatusBGColor;
        {function[0]}"""


def missing_packages() -> bool:
    return subprocess.run(["pkg-config", "--exists", *_MODULES], check=False).returncode != 0

# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a flight as SVG: from above with the mission's places and their radii, and the height over time."""

from collections.abc import Iterable, Sequence
from html import escape

from protocols.msp.mission import WpCommand, WpRecord
from simulator.flights.track import Track
from simulator.sky.earth import Place

_SIZE, _HEIGHT_SIZE, _MARGIN = 640, 160, 30
_LEAST_M = 20.0


def track_svg(track: Track, records: Sequence[WpRecord], place: Place, title: str) -> str:
    """The document; north is up."""
    marks = [
        (number, place.position(record.lat_e7 / 1e7, record.lon_e7 / 1e7), record)
        for number, record in enumerate(records)
        if record.lat_e7 or record.lon_e7
    ]
    points = [sample.position[:2] for sample in track] + [at for _, at, _ in marks]
    north = [p[0] for p in points]
    east = [-p[1] for p in points]
    span = max(max(north) - min(north), max(east) - min(east), _LEAST_M)
    scale = (_SIZE - 2 * _MARGIN) / span

    def at(position: tuple[float, ...]) -> tuple[float, float]:
        return _MARGIN + (-position[1] - min(east)) * scale, _MARGIN + (max(north) - position[0]) * scale

    path = _points(at(position) for _, position, record in marks if record.command != WpCommand.SETROI)
    size = f'width="{_SIZE}" height="{_SIZE + _HEIGHT_SIZE}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="11">',
        f"<title>{escape(title)}</title>",
        '<rect width="100%" height="100%" fill="white"/>',
        f'<polyline fill="none" stroke="#bbb" stroke-dasharray="5 4" points="{path}"/>',
    ]
    for number, position, record in marks:
        x, y = at(position)
        radius = max(record.radius_m * scale, 3)
        color = "#c60" if record.command == WpCommand.SETROI else "#06c"
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="none" stroke="{color}"/>'
            f'<text x="{x + 5:.1f}" y="{y - 5:.1f}" fill="{color}">{number}</text>'
        )
    parts.append(f'<polyline fill="none" stroke="#c03" points="{_points(at(s.position) for s in track)}"/>')
    parts.append(f'<text x="{_MARGIN}" y="{_SIZE - 8}">{escape(title)}; {span:.0f} m wide</text>')
    parts.append(_height_plot(track))
    return "\n".join((*parts, "</svg>\n"))


def _height_plot(track: Track) -> str:
    samples = track.samples
    begin, seconds = samples[0].at_s, max(samples[-1].at_s - samples[0].at_s, 1.0)
    top = max(max(sample.height for sample in samples), 1.0)
    base = _SIZE + _HEIGHT_SIZE - 20
    wide, high = _SIZE - 2 * _MARGIN, _HEIGHT_SIZE - 40
    line = _points((_MARGIN + (s.at_s - begin) / seconds * wide, base - s.height / top * high) for s in samples)
    return (
        f'<line x1="{_MARGIN}" y1="{base}" x2="{_SIZE - _MARGIN}" y2="{base}" stroke="#bbb"/>'
        f'<polyline fill="none" stroke="#083" points="{line}"/>'
        f'<text x="{_MARGIN}" y="{base - high - 6}">height, up to {top:.0f} m, over {seconds:.0f} s</text>'
    )


def _points(places: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)

"""The figure of a report as plotly.js reads it: four plots over one time axis, and the stages above them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from lsds.session.recording.report.curves import Curve, numbers

if TYPE_CHECKING:
    from lsds.session.recording.report.gather import RunData

ROWS = (
    ("y", "P(slip)", (0.76, 0.90)),
    ("y2", "slip speed, cm/s", (0.52, 0.69)),
    ("y3", "load of a finger, N", (0.26, 0.45)),
    ("y4", "aperture, mm", (0.0, 0.19)),
)
"""Axis, label and place of each plot, in parts of the height. The gaps hold the legends."""
STAGE_PLACE = (0.95, 1.0)
"""Place of the names of the stages, in parts of the height."""
SHADES = ("#eef3f8", "#ffffff")
"""Colours of the stages in turn."""
GREY, BLUE, ORANGE, GREEN, RED, PURPLE = "#444444", "#1f77b4", "#d9690b", "#2a8a3a", "#c62828", "#7b4ab3"
ROOM = 0.1
"""Room above and below the apertures of a grip, as a share of their range."""
LEAST_ROOM_MM = 0.5
"""Least room above and below the apertures of a grip, mm."""


def figure_of(data: RunData) -> dict[str, Any]:
    """Return data and layout of the figure. Names of curves state what is simulated."""
    simulated = " (simulated)" if data.simulated else ""
    curves = {name: curve.thinned() for name, curve in data.curves.items() if curve.known}
    traces: list[dict[str, Any]] = []

    def draw(name: str, axis: str, label: str, colour: str, **style: Any) -> None:
        curve = curves.get(name)
        if curve is not None:
            unit = {"y": "", "y2": "cm/s", "y3": "N", "y4": "mm"}[axis]
            if style.pop("band", False):
                traces.append(_band(curve, axis, colour))
                label += " ± 1 sigma"
            traces.append(_line(curve, axis, label + simulated, colour, unit, style))

    draw("slips", "y", "P(slip) of the grip", RED)
    draw("detected", "y", "P(slip) of the detector", GREY, dash="dot")
    draw("speed", "y2", "estimated", ORANGE, band=True)
    draw("true_speed", "y2", "true", GREY)
    draw("load", "y3", "load", PURPLE)
    draw("limit", "y3", "friction limit", GREEN, band=True)
    draw("measured", "y4", "measured", BLUE)
    draw("commanded", "y4", "commanded", ORANGE, shape="hv")
    draw("wanted", "y4", "wanted by the controller", RED, markers=True)
    return {"data": traces, "layout": _layout(data, curves)}


def _line(curve: Curve, axis: str, label: str, colour: str, unit: str, style: dict[str, Any]) -> dict[str, Any]:
    line = {"color": colour, "width": 1.4, "dash": style.get("dash", "solid"), "shape": style.get("shape", "linear")}
    return {
        "type": "scatter",
        "x": curve.t_s,
        "y": numbers(curve.values),
        "yaxis": axis,
        "name": label,
        "meta": {"unit": unit, "held": not style.get("markers", False)},
        "mode": "markers" if style.get("markers") else "lines",
        "line": line,
        "marker": {"color": colour, "size": 6, "symbol": "circle-open"},
        "hoverinfo": "none",
        "legend": "legend" + axis[1:],
    }


def _band(curve: Curve, axis: str, colour: str) -> dict[str, Any]:
    """Return one sigma around a curve as a closed area per part without gaps."""
    x: list[float | None] = []
    y: list[float | None] = []
    for part in _parts(curve):
        upper = [curve.values[at] + curve.stds[at] for at in part]
        lower = [max(curve.values[at] - curve.stds[at], 0.0) for at in part]
        t = [curve.t_s[at] for at in part]
        x += [*t, *reversed(t), None]
        y += [*numbers(upper), *reversed(numbers(lower)), None]
    return {
        "type": "scatter",
        "x": x,
        "y": y,
        "yaxis": axis,
        "mode": "lines",
        "line": {"width": 0},
        "fill": "toself",
        "fillcolor": colour + "40",
        "hoverinfo": "skip",
        "showlegend": False,
    }


def _parts(curve: Curve) -> list[list[int]]:
    """Return the numbers of the points that have a band, one list for each part without gaps."""
    known = [math.isfinite(value) and math.isfinite(std) for value, std in zip(curve.values, curve.stds, strict=True)]
    edges = [0, *(at for at in range(1, len(known)) if known[at] != known[at - 1]), len(known)]
    return [list(range(begin, end)) for begin, end in pairwise(edges) if end > begin and known[begin]]


def _layout(data: RunData, curves: dict[str, Curve]) -> dict[str, Any]:
    layout: dict[str, Any] = {
        "margin": {"l": 62, "r": 14, "t": 34, "b": 44},
        "hovermode": "x",
        "hoversubplots": "axis",
        "hoverdistance": -1,
        "spikedistance": -1,
        "dragmode": "zoom",
        "paper_bgcolor": "white",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": "system-ui, sans-serif", "size": 12},
        "xaxis": {
            "title": {"text": "time since the recording began, s"},
            "range": [data.begin_s, data.end_s],
            "anchor": "y4",
            "showspikes": True,
            "spikemode": "across",
            "spikesnap": "cursor",
            "spikethickness": 1,
            "spikedash": "solid",
            "spikecolor": "#888888",
            "gridcolor": "#dddddd",
            "zeroline": False,
        },
        "shapes": [_shade(at, stage.begin_s, stage.end_s) for at, stage in enumerate(data.stages)],
    }
    for axis, label, (low, high) in ROWS:
        layout["yaxis" + axis[1:]] = {
            "title": {"text": label},
            "domain": [low, high],
            "gridcolor": "#dddddd",
            "zeroline": False,
        }
        layout["legend" + axis[1:]] = {
            "orientation": "h",
            "x": 0,
            "y": high,
            "xanchor": "left",
            "yanchor": "bottom",
            "bgcolor": "rgba(0,0,0,0)",
        }
    layout["yaxis"]["range"] = [-0.03, 1.05]
    for axis in ("yaxis2", "yaxis3"):
        layout[axis]["rangemode"] = "tozero"
    if zoom := _grip_range(data, curves):
        layout["yaxis4"]["range"] = zoom
    return layout


def _shade(at: int, begin_s: float, end_s: float) -> dict[str, Any]:
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": begin_s,
        "x1": end_s,
        "y0": 0,
        "y1": STAGE_PLACE[0],
        "fillcolor": SHADES[at % len(SHADES)],
        "line": {"width": 0},
        "layer": "below",
    }


def _grip_range(data: RunData, curves: dict[str, Curve]) -> list[float] | None:
    """Return the range of apertures since the friction limit is known: the corrections, not the closing from open."""
    limit, measured = curves.get("limit"), curves.get("measured")
    if limit is None or measured is None:
        return None
    begin_s = next(t_s for t_s, value in zip(limit.t_s, limit.values, strict=True) if math.isfinite(value))
    values = [
        value
        for name in ("measured", "commanded", "wanted")
        if name in curves
        for t_s, value in zip(curves[name].t_s, curves[name].values, strict=True)
        if t_s >= begin_s and math.isfinite(value)
    ]
    if not values:
        return None
    room = max(LEAST_ROOM_MM, ROOM * (max(values) - min(values)))
    return [min(values) - room, max(values) + room]

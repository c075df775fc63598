"""The chart of `lsds study grip` shows every run, those that were dropped, too."""

from __future__ import annotations

from lsds_research.studies.grip import plot

from lsds.session.pictures.figure import new_figure


def row(controller, held, slip_mm):
    steady = 1.3 if held else None
    own = {"controller": controller, "held": held, "slip_mm": slip_mm}
    return {**own, "steady_over_needed": steady, "peak_over_needed": 1.6}


def test_every_point_lies_within_the_axes_of_its_panel(tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(plot, "new_figure", lambda *size: figures.append(new_figure(*size)) or figures[0])
    plot.plot_grip(tmp_path / "grip.png", [row("belief", True, 0.0), row("belief", True, 1.2), row("off", False, 55.0)])
    panels = figures[0].axes
    assert [panel.get_title() for panel in panels] == ["belief: 2 of 2 held", "off: 0 of 1 held"]
    # The two long lines are the levels 1 and 1.4.
    points = [(panel, *line.get_data()) for panel in panels for line in panel.lines if line.get_linestyle() == "None"]
    assert sum(len(x) for _, x, _ in points) == 3
    for panel, x, y in points:
        (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
        assert all(left <= each <= right for each in x)
        assert all(bottom <= each <= top for each in y)

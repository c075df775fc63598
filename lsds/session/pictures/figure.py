"""Empty figures to draw on. matplotlib is imported when something is drawn, and only then."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from lsds.support.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def new_figure(width_in: float, height_in: float, layout: Literal["constrained"] | None = "constrained") -> Figure:
    """Return an empty figure, size in inches, that can be saved as PNG. Raises MissingExtra without matplotlib."""
    require("matplotlib", extra="plot", purpose="a picture")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout=layout)
    FigureCanvasAgg(figure)
    return figure

"""The library that draws in a page, packed into the page itself. Needs the extra `report`."""

from __future__ import annotations

import base64
import gzip


def plotly_js() -> tuple[str, str]:
    """Return plotly.js, compressed with gzip and as base64, and its version."""
    from plotly.offline import get_plotlyjs, get_plotlyjs_version  # type: ignore[import-untyped]

    packed = gzip.compress(get_plotlyjs().encode("utf-8"), mtime=0)
    return base64.b64encode(packed).decode("ascii"), str(get_plotlyjs_version())

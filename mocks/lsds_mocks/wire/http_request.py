"""Recognise HTTP on ports that carry text commands.

A web page can make a browser on this machine send a request to any local port. On a port that executes lines, the body
of that request would be executed.
"""

from __future__ import annotations

import re

_REQUEST_LINE = re.compile(r"\s*[!#$%&'*+.^_`|~0-9A-Za-z-]+ +\S+ +HTTP/\d")
"""Method, target and version; RFC 9112, section 3."""


def is_http_request(line: str) -> bool:
    """Return whether a line begins an HTTP request."""
    return _REQUEST_LINE.match(line) is not None

"""Detection of HTTP requests on ports that carry text commands.

A web page can make a browser on this machine send a request to any local port. On a port that executes lines, the body
of that request would be executed.
"""

from __future__ import annotations

import re

_REQUEST = re.compile(r"\s*(?:[A-Z]+ +(?:/|\*|https?:)|\S+ +\S+ +HTTP/\d)")
"""Method and target, or method, target and version; RFC 9112, section 3. The target may be of any length."""


def is_http_request(line: str) -> bool:
    """Return whether a line, or the beginning of one, starts an HTTP request."""
    return _REQUEST.match(line) is not None

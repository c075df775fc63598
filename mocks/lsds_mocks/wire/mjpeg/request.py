"""One HTTP request to the camera, read with limits on size and time."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Literal

from lsds.clock import WallClock, nanoseconds, seconds

Wish = Literal["stream", "snapshot", "nothing", "bad-request", "bad-method", "not-found"]

LONGEST_REQUEST = 8192
"""Maximum length of a request, bytes; chosen."""
REQUEST_TIMEOUT_S = 2.0
"""Time limit for a complete request (s); chosen."""

_WISHES: dict[str, Wish] = {
    "/": "stream",
    "/stream": "stream",
    "/?action=stream": "stream",
    "/snapshot": "snapshot",
    "/?action=snapshot": "snapshot",
}


def read_request(connection: socket.socket, note: Callable[[bytes], None] = lambda _: None) -> Wish:
    """Return the requested resource; "nothing" if the client disconnected or sent no request.

    `note` receives the bytes of a complete request. Raises OSError.
    """
    clock = WallClock()
    deadline = clock.now() + nanoseconds(REQUEST_TIMEOUT_S)
    request = b""
    # One deadline covers the whole request; otherwise a client that sends a byte a second would block its thread.
    while b"\r\n\r\n" not in request and b"\n\n" not in request:
        left = seconds(deadline - clock.now())
        if left <= 0 or len(request) > LONGEST_REQUEST:
            return "bad-request" if request else "nothing"
        connection.settimeout(left)
        try:
            more = connection.recv(4096)
        except TimeoutError:
            return "bad-request" if request else "nothing"
        if not more:
            return "bad-request" if request else "nothing"
        request += more
    note(request)
    return wish(request)


def wish(request: bytes) -> Wish:
    """Return the resource requested in the first line; like mjpg-streamer, ignore any further `&key=value`."""
    words = request.split(b"\n", 1)[0].decode("latin-1").split()
    if len(words) != 3 or not words[2].startswith("HTTP/"):
        return "bad-request"
    method, target, _ = words
    if method != "GET":
        return "bad-method"
    return _WISHES.get(target.partition("&")[0], "not-found")

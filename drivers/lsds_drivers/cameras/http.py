"""MJPEG over HTTP: network cameras, mjpg-streamer, the mocks."""

from __future__ import annotations

import base64
import http.client
import socket
import time
from contextlib import suppress
from urllib.parse import unquote, urlsplit

from lsds.clock import NS_PER_S
from lsds.errors import ConnectFailed, DataError, DeviceTimeout, ProtocolFault, StaleData
from lsds_drivers.cameras.jpeg import decode
from lsds_drivers.cameras.multipart import PartReader
from lsds_drivers.cameras.source import Reduction, Shot, whole

_LOOPBACK = ("127.", "::1", "localhost")


class HttpSource:
    """A `FrameSource` that reads pictures as fast as they arrive, so that none is delayed in a buffer.

    Stamps of the server (X-Timestamp, in seconds) are used only from this machine, because another machine has another
    clock.
    """

    def __init__(self, device: str, url: str, reduction: Reduction = whole) -> None:
        self._device = device
        self._url = url
        self._reduction = reduction
        self._connection: http.client.HTTPConnection | None = None
        self._response: http.client.HTTPResponse | None = None
        self._parts: PartReader | None = None
        self._socket: socket.socket | None = None
        self._local = False

    def open(self, timeout_s: float) -> None:
        """Request the stream. Raises ConnectFailed."""
        address = urlsplit(self._url)
        make = http.client.HTTPSConnection if address.scheme == "https" else http.client.HTTPConnection
        try:
            host, port = address.hostname or "", address.port
        except ValueError as error:
            raise ConnectFailed(self._device, f"{self._url}: {error}", remedy="write http://HOST:PORT/PATH") from error
        connection = make(host, port, timeout=timeout_s)
        self._connection = connection
        self._local = host.startswith(_LOOPBACK)
        path = (address.path or "/") + (f"?{address.query}" if address.query else "")
        headers = {}
        if address.username is not None:
            pair = f"{unquote(address.username)}:{unquote(address.password or '')}".encode()
            headers["Authorization"] = "Basic " + base64.b64encode(pair).decode()
        try:
            connection.connect()
            self._socket = connection.sock
            connection.request("GET", path, headers=headers)
            response = connection.getresponse()
        except (OSError, http.client.HTTPException, ValueError) as error:
            self.close()
            raise ConnectFailed(
                self._device, f"{self._url}: {_reason(error)}", remedy="is the camera on, and the address right?"
            ) from error
        self._response = response  # from here on, close() has to close it
        kind = response.headers.get_content_type()
        boundary = response.headers.get_param("boundary")
        if response.status != 200 or kind != "multipart/x-mixed-replace" or not isinstance(boundary, str):
            self.close()
            what = f"HTTP status {response.status}" if response.status != 200 else f"not an MJPEG stream but {kind}"
            raise ConnectFailed(
                self._device, f"{self._url}: {what}", remedy="mjpg-streamer's stream is at /?action=stream"
            )
        self._parts = PartReader(self._device, boundary, self._more, time.monotonic_ns)

    def shot(self, timeout_s: float) -> Shot:
        """Wait for the next part. Raises DataError, StaleData (silent) and ConnectFailed (gone)."""
        if self._parts is None or self._socket is None:
            raise StaleData(self._device, "the stream is not open")
        try:
            self._socket.settimeout(timeout_s)
            part = self._parts.next()
        except TimeoutError as error:
            raise DeviceTimeout(self._device, f"no picture came for {timeout_s:.1f} s") from error
        except (OSError, http.client.HTTPException, ValueError) as error:
            raise ConnectFailed(self._device, f"the stream ended: {_reason(error)}") from error
        if part.headers.get("content-type", "image/jpeg").lower() not in ("image/jpeg", "image/jpg"):
            raise ProtocolFault(self._device, f"a part is {part.headers['content-type']}, not image/jpeg")
        image = decode(part.body, self._reduction)
        return Shot(image, part.arrived_ns, self._stamp(part.headers), _number(part.headers))

    def interrupt(self) -> None:
        """Shut the connection down, which ends a blocked read."""
        connected = self._socket
        if connected is not None:
            with suppress(OSError):
                connected.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close the connection."""
        for held in (self._response, self._connection, self._socket):
            if held is not None:
                with suppress(OSError):
                    held.close()
        self._connection = self._response = self._parts = self._socket = None

    def _more(self) -> bytes:
        if self._response is None:
            raise DataError("the stream is not open")
        return self._response.read1(256 * 1024)

    def _stamp(self, headers: dict[str, str]) -> int | None:
        if not self._local:
            return None
        try:
            return round(float(headers["x-timestamp"]) * NS_PER_S)
        except (KeyError, ValueError, OverflowError):
            return None


def _number(headers: dict[str, str]) -> int | None:
    text = headers.get("x-sequence", "")
    return int(text) if text.isdecimal() and len(text) < 16 else None


def _reason(error: Exception) -> str:
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).strip()

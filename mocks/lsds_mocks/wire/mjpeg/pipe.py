"""Output to a named pipe: consecutive JPEG images without separators, as `ffplay -f mjpeg PATH` reads them."""

from __future__ import annotations

import errno
import fcntl
import os
import select
import stat
import threading
from pathlib import Path

from lsds.errors import ConnectFailed
from lsds_mocks.wire.mjpeg.newest import Newest, Picture

_PIPE_POLL_S = 0.1
"""Longest wait before the pipe's thread checks again for a reader, a picture or the end, s; chosen."""
_PIPE_BYTES = 64 * 1024
"""Capacity that is requested for the pipe, bytes; chosen."""


class JpegPipe:
    """Writes the newest picture, always completely, to the reader of the pipe; readers may connect at any time."""

    def __init__(self, name: str, path: str) -> None:
        self._name = name
        self._path = Path(path).expanduser()
        self._newest = Newest()
        self._made = False
        self._closed = False
        self._thread: threading.Thread | None = None
        self.watched = False

    def start(self) -> str:
        """Create the pipe if necessary; return its path. Raises ConnectFailed if the path is not a named pipe."""
        try:
            if not self._path.exists():
                os.mkfifo(self._path, 0o600)
                self._made = True
            if not stat.S_ISFIFO(self._path.stat().st_mode):
                raise ConnectFailed(self._name, f"{self._path} is not a named pipe", remedy="choose an unused path")
        except OSError as error:
            raise ConnectFailed(
                self._name, f"{self._path}: {error.strerror}", remedy="choose a path in a writable folder"
            ) from error
        self._thread = threading.Thread(target=self._run, name=f"{self._name}-pipe", daemon=True)
        self._thread.start()
        return str(self._path)

    def publish(self, picture: Picture) -> None:
        """Set the newest picture, without waiting for the reader."""
        self._newest.put(picture)

    def close(self) -> None:
        """Stop writing, and remove the pipe if `start` created it."""
        self._closed = True
        self._newest.close()
        if self._thread is not None:
            self._thread.join(_PIPE_POLL_S * 10)
        if self._made:
            self._path.unlink(missing_ok=True)
            self._made = False

    def _run(self) -> None:
        while not self._closed:
            try:
                pipe = os.open(self._path, os.O_WRONLY | os.O_NONBLOCK)
            except OSError as error:
                if error.errno not in (errno.ENXIO, errno.EINTR):
                    return
                select.select([], [], [], _PIPE_POLL_S)  # no reader yet
                continue
            self.watched = True
            try:
                fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
                self._feed(pipe)
            except OSError:
                pass  # the reader has closed the pipe; wait for the next one
            finally:
                self.watched = False
                os.close(pipe)

    def _feed(self, pipe: int) -> None:
        number = self._newest.number
        while not self._closed:
            found = self._newest.after(number, _PIPE_POLL_S)
            if found is None:
                continue
            number, picture = found
            left = memoryview(picture.jpeg)
            # Finish a picture that has begun, or the reader would lose synchronisation.
            while left and not self._closed:
                _, writable, _ = select.select([], [pipe], [], _PIPE_POLL_S)
                if writable:
                    left = left[os.write(pipe, left) :]

"""Addresses and mocks for tests of the arm."""

from __future__ import annotations

import itertools
import os
import socket
import struct
import time

_numbers = itertools.count(2)


def fresh_host():
    """A loopback address that no other test uses, in this process or in a neighbour of the same test run."""
    pid = os.getpid()
    return f"127.{64 + pid % 128}.{pid // 128 % 250 + 1}.{next(_numbers)}"


class Dashboard:
    def __init__(self, host):
        self.socket = socket.create_connection((host, 29999), 5)
        self.socket.settimeout(5)
        self.greeting = self.line()

    def line(self):
        text = b""
        while not text.endswith(b"\n"):
            part = self.socket.recv(1)
            if not part:
                raise EOFError
            text += part
        return text.decode().rstrip("\n")

    def ask(self, request):
        self.socket.sendall(request.encode() + b"\n")
        return self.line()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()


class Primary:
    """Reads the primary interface: messages and states, as (kind, body)."""

    def __init__(self, host, port=30001):
        self.socket = socket.create_connection((host, port), 5)
        self.socket.settimeout(5)
        self.data = b""

    def package(self):
        while len(self.data) < 4 or len(self.data) < struct.unpack_from(">i", self.data)[0]:
            part = self.socket.recv(65536)
            if not part:
                raise EOFError
            self.data += part
        (size,) = struct.unpack_from(">i", self.data)
        package, self.data = self.data[:size], self.data[size:]
        return package[4], package[5:]

    def message(self, wanted):
        """The next message of a kind: its body after time stamp, source and kind."""
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            kind, body = self.package()
            if kind == 20 and body[9] == wanted:
                return body[10:]
        raise AssertionError(f"no message of kind {wanted} has come")

    def state(self):
        """The next robot state: its parts by number."""
        while True:
            kind, body = self.package()
            if kind == 16:
                break
        parts = {}
        while body:
            size, number = struct.unpack_from(">IB", body)
            parts[number] = body[5:size]
            body = body[size:]
        return parts

    def send(self, script):
        self.socket.sendall(script.encode())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

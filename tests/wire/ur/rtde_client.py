"""An RTDE client of our own, from the protocol's description; shares no code with the mock."""

from __future__ import annotations

import socket
import struct

SIZES = {
    "DOUBLE": "d",
    "VECTOR6D": "6d",
    "VECTOR3D": "3d",
    "INT32": "i",
    "UINT32": "I",
    "UINT64": "Q",
    "UINT8": "B",
    "BOOL": "?",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}


class Client:
    def __init__(self, host, version=2):
        self.socket = socket.create_connection((host, 30004), 5)
        self.socket.settimeout(5)
        self.version = version
        self.data = b""
        self.names, self.types = [], []
        if version:
            assert self.ask("V", struct.pack(">H", version)) == b"\x01"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, kind, payload=b""):
        self.socket.sendall(struct.pack(">HB", len(payload) + 3, ord(kind)) + payload)

    def receive(self):
        while len(self.data) < 3 or len(self.data) < struct.unpack_from(">H", self.data)[0]:
            more = self.socket.recv(65536)
            if not more:
                raise EOFError
            self.data += more
        (size,) = struct.unpack_from(">H", self.data)
        package, self.data = self.data[:size], self.data[size:]
        return chr(package[2]), package[3:]

    def ask(self, kind, payload=b""):
        self.send(kind, payload)
        while True:
            answer, body = self.receive()
            if answer == kind:
                return body

    def outputs(self, *names, rate=500.0):
        body = ",".join(names).encode()
        answer = self.ask("O", struct.pack(">d", rate) + body if self.version == 2 else body)
        number, types = (answer[0], answer[1:]) if self.version == 2 else (None, answer)
        self.names, self.types = list(names), types.decode().split(",")
        return number, self.types

    def inputs(self, *names):
        answer = self.ask("I", ",".join(names).encode())
        return answer[0], answer[1:].decode().split(",")

    def start(self):
        return self.ask("S") == b"\x01"

    def pause(self):
        return self.ask("P") == b"\x01"

    def write(self, recipe, layout, *values):
        self.send("U", bytes([recipe]) + struct.pack(">" + layout, *values))

    def sample(self):
        while True:
            kind, body = self.receive()
            if kind == "U":
                break
        flat = list(struct.unpack(">" + "".join(SIZES[t] for t in self.types), body[1:] if self.version == 2 else body))
        found = {}
        for name, kind in zip(self.names, self.types, strict=True):
            size = int(SIZES[kind][0]) if SIZES[kind][0].isdigit() else 1
            found[name] = flat[:size] if size > 1 else flat[0]
            del flat[:size]
        return found

    def until(self, name, value, samples=2000):
        for _ in range(samples):
            sample = self.sample()
            if sample[name] == value:
                return sample
        raise AssertionError(f"{name} never became {value}, it is {sample[name]}")

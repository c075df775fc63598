"""A small wire mock that keeps its contract: it echoes lines. The mutants are it with one mistake each."""

from __future__ import annotations

import contextlib
import select
import socket

from pydantic import BaseModel, ConfigDict, Field

from lsds.errors import ConfigError, ConfigIssue, ConnectFailed

KINDS = ("silent", "slow")


class Options(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    host: str = Field(default="127.0.0.1")
    port: int = Field(default=0, ge=0, le=65535)


class HonestWireMock:
    def __init__(self, options, context):
        self.options = options
        self.listener = None
        self.links = []

    def listen(self):
        return socket.create_server((self.options.host, self.options.port))

    def start(self):
        try:
            self.listener = self.listen()
        except OSError as error:
            raise ConnectFailed("honest", f"cannot listen: {error}", remedy="choose another port") from error
        return {"tcp": f"{self.options.host}:{self.listener.getsockname()[1]}"}

    def serve(self, stop):
        while not stop.is_set():
            for ready in select.select([self.listener, *self.links], [], [], 0.02)[0]:
                if ready is self.listener:
                    self.links.append(self.listener.accept()[0])
                else:
                    self.answer(ready)

    def answer(self, link):
        with contextlib.suppress(OSError):
            if data := link.recv(4096):
                link.send(data, socket.MSG_DONTWAIT)
                return
        self.links.remove(link)
        link.close()

    def inject(self, fault):
        kind = fault.get("kind")
        if kind not in KINDS:
            raise ConfigError(
                "honest", [ConfigIssue("fault.kind", f"{kind!r} is unknown", f"one of: {', '.join(KINDS)}")]
            )

    def close(self):
        for link in self.links:
            link.close()
        self.links.clear()
        if self.listener is not None:
            self.listener.close()

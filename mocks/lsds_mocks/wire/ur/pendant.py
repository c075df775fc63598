"""The teach pendant: load and play programs, remote control, operational modes."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import TYPE_CHECKING

from lsds.clock import WallClock, nanoseconds
from lsds_mocks.wire.address import on_loopback
from lsds_mocks.wire.ur.modes import RobotMode, SafetyMode
from lsds_mocks.wire.ur.script.compiler import LONGEST_PROGRAM
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.sender import listening_ports, sender_of

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller
    from lsds_mocks.wire.ur.sender import Sender
    from lsds_mocks.wire.ur.uploads import Script, Uploads

FOLDER = "/programs"
EXTERNAL_CONTROL, WAIT = "external_control.urp", "wait_program.urp"
_WAIT_SCRIPT = "def wait_program():\n  while True:\n    sleep(0.01)\n  end\nend\n"
INSTALLATION = "default.installation"
"""Installation that always exists."""
SHUTDOWN_S = 0.5
"""Time from the reply to `shutdown` until all ports close, s; shorter than a real controller's, to save test time."""
_REQUEST_S = 5.0
"""Time limit for the first bytes of a requested script."""
_SCRIPT_S = 10.0
"""Time limit for the whole script."""


class Pendant:
    """The teach pendant of one controller, which also receives the scripts and commands of the script ports."""

    def __init__(self, controller: Controller, uploads: Uploads) -> None:
        self.controller = controller
        self.loaded = ""
        self.ends_s: float | None = None
        """Time of the controller at which it is switched off; None: it stays on."""
        self._mode = "NONE"
        self._uploads = uploads
        self._commands = {
            "power on": controller.power_on,
            "power off": self.power_off,
            "set robotmode run": lambda: controller.power_on(brakes=True),
            "set unlock protective stop": controller.unlock,
            "stop program": self.stop,
            "pause program": controller.pause_program,
        }

    @property
    def operational_mode(self) -> str:
        """MANUAL, AUTOMATIC, or NONE if not set."""
        return self._mode

    @operational_mode.setter
    def operational_mode(self, mode: str) -> None:
        """Manual mode disables remote control, automatic mode enables it."""
        self._mode = mode
        if mode != "NONE":
            self.controller.hand_over(remote=mode == "AUTOMATIC" and self.controller.options.remote_control)

    def script(self, text: str, sender: Sender | None = None) -> None:
        """Run one program or command from a script port."""
        command = self._commands.get(text.strip())
        if command is not None:
            command()
        else:
            self._uploads.submit(text + "\n", sender)

    def poll(self) -> bool:
        """Start a compiled program or report its error; return whether there was one."""
        compiled = self._uploads.poll()
        if isinstance(compiled, ScriptError):
            self.controller.refuse(compiled)
        elif compiled is not None:
            self.controller.start(compiled)
        return compiled is not None

    def stop(self) -> None:
        """Stop the running program and those that are still being compiled: nothing moves after it."""
        self._uploads.cancel()
        self.controller.stop_program()

    def power_off(self) -> None:
        """Switch the arm off; programs that are still being compiled are dropped."""
        self._uploads.cancel()
        self.controller.power_off()

    def shut_down(self) -> None:
        """Switch the arm off, and soon the controller."""
        self.power_off()
        self.ends_s = self.controller.time_s + SHUTDOWN_S

    def has_installation(self, name: str) -> bool:
        """Return whether an installation exists: the default one, or a file in the folder of programs."""
        own, folder = Path(name).name, self.controller.options.programs
        return own == INSTALLATION or bool(folder and own and (Path(folder) / own).is_file())

    def load(self, name: str) -> str:
        """Load a program by its file name and stop the running one; return its path, "" if it does not exist."""
        path = name if name.startswith("/") else f"{FOLDER}/{name}"
        if Path(name).name not in (EXTERNAL_CONTROL, WAIT) and self._file(name) is None:
            return ""
        self.stop()
        self.loaded = path
        return path

    def play(self) -> bool:
        """Start the loaded program, or resume a paused one; return whether that is possible."""
        if self.controller.resume_program():
            return True
        ready = self.controller.power.mode is RobotMode.RUNNING and self.controller.safety is SafetyMode.NORMAL
        if not ready or not self.loaded:
            return False
        name = Path(self.loaded).name
        if name == WAIT:
            self._uploads.submit(_WAIT_SCRIPT)
        elif name == EXTERNAL_CONTROL:
            self._uploads.fetch(self._external_control)
        else:
            file = self._file(self.loaded)
            if file is None:
                return False
            self._uploads.submit(file.read_text("utf-8", "replace"))
        return True

    def _file(self, name: str) -> Path | None:
        folder = self.controller.options.programs
        if not folder:
            return None
        stem = Path(name).name.removesuffix(".urp")
        file = Path(folder) / f"{stem}.script"
        return file if file.is_file() else None

    def _external_control(self) -> Script:
        """Request the script from the other computer, as the External Control URCap does; "" if it does not answer.

        Raises ScriptError for a script that is too long.
        """
        options = self.controller.options
        if not on_loopback(options.urcap_host):
            return "", frozenset
        try:
            with socket.create_connection((options.urcap_host, options.urcap_port), _REQUEST_S) as link:
                link.settimeout(_REQUEST_S)
                link.sendall(b"request_program\n")
                sender = sender_of(link)
                script = bytearray()
                clock = WallClock()
                ends_ns = clock.now() + nanoseconds(_SCRIPT_S)
                while part := link.recv(1 << 16):
                    script += part
                    if len(script) >= LONGEST_PROGRAM:
                        raise ScriptError(f"syntax_error: a program has at most {LONGEST_PROGRAM} characters", 1, 1)
                    if clock.now() > ends_ns:
                        # A sender that never finishes must not keep all other scripts waiting.
                        return "", frozenset
                    if part.endswith(b"\n") and not _more(link):
                        break
                # Look the ports up while the sender's connection is still open.
                ports = frozenset() if sender is None else listening_ports(sender)
        except OSError:
            return "", frozenset
        text = script.decode("utf-8", "replace")
        if not text.lstrip().startswith(("def ", "sec ")):
            text = f"def external_control():\n{text}\nend\n"
        return text, lambda: ports


def _more(link: socket.socket) -> bool:
    """Return whether more data arrives within 0.1 s, because not every sender closes the connection at the end."""
    link.settimeout(0.1)
    try:
        return bool(link.recv(1, socket.MSG_PEEK))
    except TimeoutError:
        return False
    finally:
        link.settimeout(_REQUEST_S)

"""A third-party gripper for subprocess tests: each call can be made to hang, and it can leave things running."""

from __future__ import annotations

FILES = {
    "acme_hangs/__init__.py": "",
    "acme_hangs/manifest.py": """
from lsds.contracts import BackendSpec
from lsds.registry import hookimpl


@hookimpl
def lsds_backends():
    where = "acme_hangs.gripper:"
    return [BackendSpec("gripper", "acme", where + "Acme", where + "Options", virtual_time=True, in_cell=True)]
""",
    "acme_hangs/gripper.py": """
import multiprocessing
import subprocess
import sys
import threading
import time
from pathlib import Path

from lsds_mocks.devices.hand_e import MockHandE
from lsds_mocks.devices.hand_e_options import HandEOptions
from pydantic import Field


class Options(HandEOptions):
    hangs: str = Field(default="", description="call that hangs")
    from_call: int = Field(default=1, description="from which call on")
    leaves: str = Field(default="", description="what is left running: thread, process or program")
    marker: str = Field(default="", description="file that is created when it hangs")


def for_ever():
    while True:
        time.sleep(3600)


class Acme(MockHandE):
    def __init__(self, options, context):
        super().__init__(options, context)
        self.left = options.from_call
        if options.leaves == "thread":
            threading.Thread(target=for_ever, name="acme-pump").start()
        if options.leaves == "process":
            multiprocessing.get_context("fork").Process(target=for_ever, name="acme-child").start()
        if options.leaves == "program":
            program = "import time; time.sleep(20)"
            pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
            subprocess.Popen([sys.executable, "-c", program], **pipes)


def hanging(name):
    def call(self, *arguments):
        if self.options.hangs == name:
            self.left -= 1
            if self.left <= 0:
                if self.options.marker:
                    Path(self.options.marker).touch()
                for_ever()
        return getattr(super(Acme, self), name)(*arguments)

    return call


for name in ("connect", "arm", "read", "command", "stop", "close"):
    setattr(Acme, name, hanging(name))
""",
    "acme_hangs-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: acme-hangs\nVersion: 1.0\n",
    "acme_hangs-1.0.dist-info/entry_points.txt": "[lsds]\nacme-hangs = acme_hangs.manifest\n",
}

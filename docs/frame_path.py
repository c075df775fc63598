"""Count the files that one commanding frame crosses: `python docs/frame_path.py` (needs the extra sim).

Traces the calls of every frame of the simulated cell's lift and prints those of the median commanding frame. The files
of the mocks do not count: a real cell has others in their place. A change is a call into another file than the call
before it.
"""

from __future__ import annotations

import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path
from types import CodeType, FrameType

import lsds
from lsds.runtime.engine import Engine

ROOT = Path(__file__).resolve().parents[1]


def commanding_frames() -> list[list[str]]:
    """Return, for each frame of a lift that sends the gripper a command, the file of each call, in order."""
    frames = []
    poll = Engine._poll
    places: dict[CodeType, str] = {}

    def place(code: CodeType) -> str:
        path = Path(code.co_filename)
        counts = ROOT in path.parents and not {"site-packages", "mocks"} & set(path.parts)
        return str(path.relative_to(ROOT)) if counts else ""

    def traced(engine: Engine, now_ns: int) -> None:
        files: list[str] = []

        def called(frame: FrameType, event: str, argument: object) -> None:
            if event == "call":
                code = frame.f_code
                if code not in places:
                    places[code] = place(code)
                if places[code]:
                    files.append(places[code])

        before = engine._newest
        sys.setprofile(called)
        try:
            poll(engine, now_ns)
        finally:
            sys.setprofile(None)
        newest = engine._newest
        if newest is not before and newest is not None and newest.command_m is not None:
            frames.append(files)

    Engine._poll = traced  # type: ignore[method-assign, assignment]
    try:
        lsds.run()
    finally:
        Engine._poll = poll  # type: ignore[method-assign]
    return frames


def main() -> None:
    """Print number of files, changes and calls, and the number of calls into each file."""
    frames = sorted(commanding_frames(), key=lambda files: len(set(files)))
    files = frames[len(frames) // 2]
    changes = sum(a != b for a, b in pairwise(files))
    print(f"{len(set(files))} files, {changes} changes of file, {len(files)} calls")
    for name, calls in sorted(Counter(files).items()):
        print(f"{calls:4}  {name}")


if __name__ == "__main__":
    main()

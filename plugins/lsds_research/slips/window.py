"""A window to label in: the kymograph above, a strip of frames below, and keys. Needs the extra `plot`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from lsds_research.slips.labels import State
from lsds_research.slips.marking import KEYS, Marking
from lsds_research.slips.pictures import IN_A_ROW, kymograph, strip

if TYPE_CHECKING:
    from lsds_research.slips.recording_view import RecordingView

HELP = (
    "left/right: a frame   up/down: a row   n/p: next/previous motion   m: mark   "
    "f free   k stick   s slip   t touch   u unsure   z undo   q quit"
)
_COLOURS = {
    State.FREE: "0.8",
    State.STICK: "tab:green",
    State.SLIP: "tab:red",
    State.TOUCH: "tab:blue",
    State.UNSURE: "tab:orange",
}
_STEPS = {"right": 1, "left": -1, "up": -IN_A_ROW, "down": IN_A_ROW}


class LabelWindow:
    """Shows one recording; calls `save` after each change."""

    def __init__(self, seen: RecordingView, marking: Marking, save: Callable[[Marking], object]) -> None:
        import matplotlib.pyplot as plt

        # The window's own keys would save pictures and close it.
        for name in [name for name in plt.rcParams if name.startswith("keymap.")]:
            plt.rcParams[name] = []  # pyright: ignore[reportArgumentType]
        self._seen, self._marking, self._save = seen, marking, save
        self._motions = [first for first, _ in seen.moving()]
        self._strip: tuple[int, Any] = (-1, None)
        self.figure, (self._whole, self._band, self._row) = plt.subplots(
            3, 1, figsize=(14, 9), height_ratios=(5, 0.3, 5), layout="constrained"
        )
        self._whole.imshow(kymograph(seen), aspect="auto", extent=(0, len(seen), 1, 0))
        self._whole.set_yticks([])
        self._line = self._whole.axvline(0.5, color="yellow")
        # matplotlib holds methods by weak references only.
        self.figure.canvas.mpl_connect("key_press_event", lambda event: self.press(event))
        self._draw()

    def press(self, event: Any) -> None:
        """Do what a key asks for."""
        key, marking = event.key, self._marking
        if key in _STEPS:
            marking.move(_STEPS[key])
        elif key in ("n", "p"):
            ahead = [at - marking.cursor for at in self._motions if (at > marking.cursor) == (key == "n")]
            steps = [step for step in ahead if step]
            marking.move((min if key == "n" else max)(steps, default=0))
        elif key == "m":
            marking.mark = marking.cursor
        elif key in KEYS:
            marking.set(KEYS[key])
            self._save(marking)
        elif key == "z":
            marking.undo()
            self._save(marking)
        elif key == "q":
            import matplotlib.pyplot as plt

            plt.close(self.figure)
            return
        self._draw()

    def _draw(self) -> None:
        seen, marking = self._seen, self._marking
        begin = marking.cursor // IN_A_ROW * IN_A_ROW
        if self._strip[0] != begin:
            self._strip = begin, strip(seen, begin, min(begin + IN_A_ROW, len(seen)) - 1)
        self._row.clear()
        self._row.imshow(self._strip[1], aspect="auto", extent=(begin, begin + IN_A_ROW, 1, 0))
        first, last = marking.chosen
        self._row.axvspan(max(first, begin), last + 1, color="yellow", alpha=0.15)
        self._row.set_xlim(begin, begin + IN_A_ROW)
        self._row.set_yticks([])
        self._line.set_xdata([marking.cursor + 0.5] * 2)
        self._band.clear()
        for own in marking.intervals:
            self._band.axvspan(own.first, own.last + 1, color=_COLOURS[own.state], alpha=own.confidence and 1.0)
        self._band.set_xlim(0, len(seen))
        self._band.set_yticks([])
        state = marking.at(marking.cursor).state.name.lower()
        self._whole.set_title(f"{seen.name}, frame {marking.cursor} of {len(seen)}: {state}\n{HELP}", fontsize=9)
        self.figure.canvas.draw_idle()

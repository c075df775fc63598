"""Print what the tests assert: `cd tests && python -m tactile.measure`."""

from __future__ import annotations

import numpy as np
from tactile.following import FOLLOWERS, Bench, bump, jumps, rms


def sub_pitch(name, shape="uniform", **look):
    """RMS (px) and lost tracks over a wandering path of less than half a pitch."""
    bench = Bench(name)
    weight = {"uniform": 1.0, "bump": bump(bench.rest, 60)}[shape]
    path = [weight * np.array([11 * np.sin(i / 3), 11 * np.cos(i / 4) - 11]) for i in range(30)]
    steps = [bench.move(displacement, **look) for displacement in path]
    return rms(steps), sum(int((~s.valid).sum()) for s in steps)


def main():
    for name in FOLLOWERS:
        for shape in ("uniform", "bump"):
            for look in ({}, {"gain": 0.8}, {"gain": 1.2}):
                error, lost = sub_pitch(name, shape, **look)
                print(f"{name} {shape} {look or ''}: rms {error:.4f} px, {lost} flagged")
        total = np.zeros(3, int)
        for travel, (tracks, wrong, unflagged) in jumps(name).items():
            print(f"{name} jump {travel} px: {wrong} of {tracks} not followed, {unflagged} wrong and unflagged")
            total += (tracks, wrong, unflagged)
        tracks, wrong, unflagged = total
        print(
            f"{name} jumps together: wrong and unflagged {unflagged / tracks:.2%} of tracks, "
            f"flagged {1 - unflagged / max(wrong, 1):.2%} of those not followed"
        )


if __name__ == "__main__":
    main()

"""A common chain for comparison: an OpenCV tracker, a scikit-learn forest and a torch LSTM, one call each per frame.

Field, contact and features are ours in both chains, so the ratio of the two favours the peers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, Frame
from lsds.contracts.learning import Examples, Fitted, Learner
from lsds.models.signals import Picker
from lsds.models.window import Window
from lsds.tactile.perception import Perception

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds.config import RigConfig
    from lsds.contracts import SensorSpec
    from lsds.registry import PluginHost

#: Libraries of the training extra that the chain calls.
NEEDS = ("sklearn", "torch", "onnx")


class PeerModels:
    """The paper's forest and LSTM, fitted on the clip itself: only their size affects the time."""

    def __init__(self, host: PluginHost, frames: Sequence[Frame], perception: Perception) -> None:
        self.forest, self.forest_fit = _fitted(host, "random-forest", frames, perception)
        self.lstm, self.lstm_fit = _fitted(host, "lstm", frames, perception)


class PeerChain:
    """One tracker with the models behind it. `answer` maps a frame to slip and speed."""

    def __init__(self, tracker: Any, models: PeerModels, spec: SensorSpec, config: RigConfig, reference: Frame) -> None:
        self._perception = Perception(tracker, spec, config.tactile)
        self._perception.start([reference])
        self._calls = [
            (Picker(learner.signals), Window(learner.length, len(learner.signals)), fitted)
            for learner, fitted in ((models.forest, models.forest_fit), (models.lstm, models.lstm_fit))
        ]

    def answer(self, frame: Frame) -> list[Any]:
        """Return the probability of slip and the speeds, None if a signal is undefined."""
        observation, _ = self._perception.observe(frame)
        answers: list[Any] = []
        for pick, window, fitted in self._calls:
            picked = pick(observation)
            if picked is None:
                answers.append(None)
                continue
            window.push(picked)
            answers.append(fitted.predict(window.frames))
        return answers


def _fitted(host: PluginHost, name: str, frames: Sequence[Frame], perception: Perception) -> tuple[Learner, Fitted]:
    learner: Learner = host.build("learner", host.own("learner", name), {}, BuildContext(VirtualClock()))
    pick, window = Picker(learner.signals), Window(learner.length, len(learner.signals))
    taken, speeds = [], []
    perception.reset()
    for frame in frames:
        observation, _ = perception.observe(frame)
        picked = pick(observation)
        if picked is not None:
            window.push(picked)
            taken.append(window.frames[0].copy())
            speeds.append(observation.features["mean_speed"])
    speed = np.nan_to_num(np.array(speeds, np.float32))
    fast = (speed > np.median(speed)).astype(np.float32)
    target = fast if learner.job == "detect" else np.stack([0 * speed, speed, 0 * speed], axis=1)
    group = np.arange(len(taken)) // 10
    return learner, learner.fit(Examples(np.array(taken, np.float32), target, group), 0)

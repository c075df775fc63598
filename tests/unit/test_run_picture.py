"""The picture of a run: the part of the time that it shows, and names of stages that do not collide."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from lsds.session.pictures import run as pictures
from lsds.session.record import Sample

LIFT = [("lift", 60), ("hold", 20)]
STAGES = [
    ("reference", 40),
    ("approach", 60),
    ("touch", 4),
    ("squeeze", 2),
    ("settle", 3),
    ("take up", 5),
    ("lift", 60),
    ("hold", 20),
]
ACTING = ("take up", "lift", "hold")


@pytest.fixture
def samples():
    blank = Sample(0, "", False, False, 1.0, math.nan, False, 0.0, 0.0, math.nan, None, 0.02, 0.02)
    names = [stage for stage, count in STAGES for _ in range(count)]
    return [
        dataclasses.replace(blank, t_ns=number * 40_000_000, stage=stage, acting=stage in ACTING)
        for number, stage in enumerate(names)
    ]


@pytest.fixture
def drawn(samples):
    pytest.importorskip("matplotlib")
    figure = pictures.new_figure(8, 3)
    axes = figure.add_subplot()
    t = np.array([sample.t_ns * 1e-9 for sample in samples])
    window = pictures._window(samples, t)
    axes.set_xlim(*window)
    pictures._shade_stages(axes, samples, t, window, named=True)
    figure.canvas.draw()
    return figure, axes, window


def test_the_lift_fills_the_time_axis(samples, drawn):
    _, _, (begin, end) = drawn
    first = next(sample.t_ns for sample in samples if sample.acting) * 1e-9
    assert end == samples[-1].t_ns * 1e-9
    assert (end - first) / (end - begin) == pytest.approx(1 - pictures.LEAD)


def test_a_run_that_never_corrected_is_drawn_whole(samples):
    idle = [dataclasses.replace(sample, acting=False) for sample in samples]
    t = np.array([sample.t_ns * 1e-9 for sample in idle])
    assert pictures._window(idle, t) == (t[0], t[-1])


def test_no_two_names_of_stages_overlap(drawn):
    _, axes, _ = drawn
    boxes = [text.get_window_extent() for text in axes.texts]
    assert {text.get_text().strip() for text in axes.texts} >= {"touch", "squeeze", "settle", "take up", "lift", "hold"}
    for at, one in enumerate(boxes):
        assert not any(one.overlaps(other) for other in boxes[at + 1 :])

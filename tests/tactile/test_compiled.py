"""The compiled inner loops give what the portable ones give, on painted scenes and on noise."""

from __future__ import annotations

import importlib
import math
import sys

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tactile.imprinted import HEIGHT, METRES_PER_PX, PITCH, WIDTH, Motion, bumps, dots, field, painted

from lsds.contracts import Frame
from lsds.errors import MissingExtra
from lsds.tactile import compiled
from lsds.tactile.depth import DepthEstimator
from lsds.tactile.imprint.carrying import CarriedGel
from lsds.tactile.imprint.layers import Layers
from lsds.tactile.imprint.motion import ImprintFollower, ImprintMotion
from lsds.tactile.imprint.relief import Relief, ReliefMaker

pytest.importorskip("numba")
BUMPS, REFERENCE, STILL = bumps(), dots(), Motion()
SIZES = st.tuples(st.integers(12, 90), st.integers(12, 120))


def noise(size: tuple[int, int], seed: int, brightest: int = 200) -> Frame:
    """Return an image of noise, smooth over some pixels, with black markers."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(30, brightest, (size[0] // 4 + 2, size[1] // 4 + 2, 3))
    image = np.kron(coarse, np.ones((8, 8, 1)))[: 2 * size[0], : 2 * size[1]] + rng.normal(
        0, 3, (2 * size[0], 2 * size[1], 3)
    )
    image[5::24, 5::24] = image[6::24, 6::24] = 0
    return Frame(np.clip(image, 0, 255).astype(np.uint8), seed, seed)


def reliefs(frame: Frame) -> tuple[Relief, Relief]:
    return ReliefMaker().relief(frame), ReliefMaker(compiled=True).relief(frame)


@settings(max_examples=40)
@given(size=SIZES, seed=st.integers(0, 2**16), brightest=st.sampled_from([120, 200, 260]))
def test_a_relief_of_any_size_is_the_same(size: tuple[int, int], seed: int, brightest: int) -> None:
    portable, fast = reliefs(noise(size, seed, brightest))
    assert np.array_equal(fast.weight, portable.weight)
    assert fast.scale == portable.scale
    scale = max(float(np.abs(portable.curvature).max()), 1e-3)
    assert fast.curvature == pytest.approx(portable.curvature, abs=2e-5 * scale)


@settings(max_examples=30)
@given(size=SIZES, seed=st.integers(0, 2**16), level=st.integers(0, 2))
def test_nearly_the_same_edges_are_chosen(size: tuple[int, int], seed: int, level: int) -> None:
    relief = ReliefMaker().relief(noise(size, seed))
    portable, fast = (Layers(relief, compiled=kind)[level].edges for kind in (False, True))
    places = [set(zip(edges.x.tolist(), edges.y.tolist(), strict=True)) for edges in (portable, fast)]
    # A pixel at the bound may be on either side of it.
    assert len(places[0] ^ places[1]) <= 4
    if len(portable) > 50:
        assert fast.centre == pytest.approx(portable.centre, abs=0.2)
        assert fast.radius == pytest.approx(portable.radius, rel=0.02)
        assert fast.total == pytest.approx(portable.total, rel=0.02)
    common = sorted(places[0] & places[1])
    rows = [{(x, y): row for x, y, *row in edges.table.T.tolist()} for edges in (portable, fast)]
    for place in common:
        assert rows[1][place] == pytest.approx(rows[0][place], rel=1e-4, abs=1e-6)


@settings(max_examples=40)
@given(count=st.integers(6, 120), seed=st.integers(0, 2**16), line=st.booleans())
def test_the_gel_is_carried_alike(count: int, seed: int, line: bool) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(0, 300, (count, 2)) * (1.0, 0.0 if line else 0.75)
    moved = rng.normal(0, 5, (count, 2))
    portable, fast = (CarriedGel(position, moved, PITCH, (320, 240), compiled=kind) for kind in (False, True))
    x, y = rng.uniform(-20, 340, (2, 50)).astype(np.float32)
    # OpenCV rounds positions between the nodes to 1/32 of their distance.
    assert fast.at(x, y) == pytest.approx(portable.at(x, y), abs=1e-3)
    assert fast.fastest_px == portable.fastest_px


def followed(kind: bool, body: Motion, gel: Motion, seed: int) -> ImprintMotion | None:
    follower = ImprintFollower(METRES_PER_PX, REFERENCE, painted(BUMPS * 0, STILL, STILL), compiled=kind)
    follower.follow(painted(BUMPS, STILL, STILL, noise=1.0, seq=seed), field(STILL, REFERENCE))
    return follower.follow(painted(BUMPS, body, gel, noise=1.0, seq=seed + 1), field(gel, REFERENCE, 1))()


@settings(max_examples=30)
@given(
    slip=st.tuples(st.floats(-12, 12), st.floats(-12, 12), st.floats(-10, 10)),
    gel=st.tuples(st.floats(-4, 4), st.floats(-4, 4)),
    seed=st.integers(0, 100),
)
@example(slip=(0.0, 0.0, 0.0), gel=(0.5, 0.5), seed=7).via("the gain changes in the last step")
def test_the_imprint_is_followed_alike(slip: tuple[float, float, float], gel: tuple[float, float], seed: int) -> None:
    body = Motion(slip[0] + gel[0], slip[1] + gel[1], math.radians(slip[2]))
    portable, fast = (followed(kind, body, Motion(*gel), seed) for kind in (False, True))
    assert portable is not None
    assert fast is not None
    # OpenCV rounds positions between pixels to 1/32 of their distance.
    assert fast.slip_m == pytest.approx(portable.slip_m, abs=0.05 * METRES_PER_PX)
    assert fast.turn_rad == pytest.approx(portable.turn_rad, abs=5e-4)
    assert fast.match == pytest.approx(portable.match, abs=5e-3)
    assert fast.stuck_match == pytest.approx(portable.stuck_match, abs=5e-3)
    assert fast.seen == pytest.approx(portable.seen, abs=0.01)
    assert fast.gain == pytest.approx(portable.gain, rel=0.01)
    assert fast.residual == pytest.approx(portable.residual, rel=0.02)
    assert fast.information == pytest.approx(portable.information, rel=0.1, abs=0.02 * portable.information.max())


def test_an_empty_image_has_no_motion_in_either() -> None:
    flat = Frame(np.full((HEIGHT, WIDTH, 3), 120, np.uint8), 0, 0)
    for kind in (False, True):
        follower = ImprintFollower(METRES_PER_PX, REFERENCE, flat, compiled=kind)
        follower.follow(flat, field(STILL, REFERENCE))
        assert follower.follow(flat, field(STILL, REFERENCE, 1))() is None


@settings(max_examples=20)
@given(
    seed=st.integers(0, 2**16),
    scale=st.sampled_from([2, 4, 8, 16]),
    size=st.sampled_from([(120, 160), (128, 160), (96, 128), (75, 100), (121, 160)]),
)
@example(seed=2472, scale=8, size=(120, 160)).via("a pixel at the threshold")
def test_depth_and_contact_are_the_same(seed: int, scale: int, size: tuple[int, int]) -> None:
    frames = [noise(size, seed), noise(size, seed + 1)]
    portable, fast = (
        DepthEstimator(frames[0], METRES_PER_PX, scale=scale, compiled=kind).measure(frames[1])
        for kind in (False, True)
    )
    wide = 1e-4 * float(np.ptp(portable.depth_m))
    zero = float(np.median(fast.depth_m - portable.depth_m))
    assert fast.depth_m - zero == pytest.approx(portable.depth_m, abs=wide)
    # A pixel that is as deep as the threshold, but for rounding, is free of contact in one of them only. The zero is a
    # quantile of the free pixels, so it may then be the next pixel's depth.
    ranked = np.sort(portable.depth_m, axis=None)
    above, below = ranked[ranked > wide], ranked[ranked < -wide]
    next_m = max(above.min(initial=np.inf), -below.max(initial=-np.inf)) if above.size and below.size else 0.0
    assert abs(zero) <= next_m + wide
    # Such a zero also moves the contact's edge, by about one pixel's area.
    assert fast.area_fraction == pytest.approx(portable.area_fraction, abs=2e-3 + (abs(zero) > wide) / ranked.size)


def test_the_option_chooses(monkeypatch: pytest.MonkeyPatch) -> None:
    assert compiled.use_compiled("auto")
    assert compiled.use_compiled("compiled")
    assert not compiled.use_compiled("portable")
    monkeypatch.setattr(compiled, "importable", lambda name: False)
    assert not compiled.use_compiled("auto")


def test_without_numba_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lsds.support.extras.importable", lambda name: False)
    with pytest.raises(MissingExtra, match=r"tactile.arithmetic.*lsds-tactile\[fast\]"):
        compiled.use_compiled("compiled")


def test_nothing_is_compiled_after_the_preparation() -> None:
    compiled.use_compiled("compiled")
    found = [
        function
        for module in ("carrying", "depth", "edges", "registration", "relief", "sharpness")
        for name, function in vars(importlib.import_module(f"lsds.tactile.compiled.{module}")).items()
        if hasattr(function, "signatures") and not name.startswith("_")
    ]
    before = [list(function.signatures) for function in found]
    assert len(found) > 8
    assert all(before)
    assert followed(True, Motion(2.0, 1.0, 0.05), Motion(1.0), 3) is not None
    frames = [noise((128, 160), 1), noise((128, 160), 2)]
    DepthEstimator(frames[0], METRES_PER_PX, compiled=True).measure(frames[1])
    assert [list(function.signatures) for function in found] == before


def test_a_numba_that_does_not_work_is_no_reason_to_stop(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "lsds.tactile.compiled.prepare", None)
    compiled._notice.cache_clear()
    assert not compiled.use_compiled("auto")
    assert "the frame path is not compiled: numba does not work here" in capsys.readouterr().err
    with pytest.raises(MissingExtra, match="numba does not work here"):
        compiled.use_compiled("compiled")


def test_a_numba_that_only_interprets_is_not_used(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr("numba.config.DISABLE_JIT", 1)
    compiled._notice.cache_clear()
    assert not compiled.use_compiled("auto")
    assert "numba does not work here: RuntimeError: NUMBA_DISABLE_JIT is set" in capsys.readouterr().err

"""The relief's spectrum and how long it lasts, on reliefs of known waves and known motion."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.studies.realism.film import write
from lsds_research.studies.realism.imprint import BANDS, MOTIONS, PLACES, kept, relief_row, relief_table, spectrum
from tactile.imprinted import METRES_PER_PX, Motion, bumps, dots, field, painted

from lsds.tactile.imprint.relief import Relief, ReliefMaker

SHAPE = (120, 160)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(float)
EVERYWHERE = np.ones(SHAPE, bool)
MM = 0.125


def wave(per_mm, amplitude=1.0, weight=None):
    curvature = amplitude * np.sin(2 * np.pi * per_mm * MM * X).astype(np.float32)
    return Relief(curvature, np.ones(SHAPE, np.float32) if weight is None else weight, 2.0)


@pytest.mark.parametrize("number", range(len(BANDS)))
def test_a_wave_is_seen_in_its_band_with_its_strength(number):
    low, high = BANDS[number]
    found = spectrum(wave((low + high) / 2, 0.02), EVERYWHERE, MM)
    assert found[number] == pytest.approx(0.02 / MM / np.sqrt(2), rel=0.1)
    assert np.delete(found, number).max() < 0.3 * found[number]


def test_what_a_mask_leaves_out_does_not_count():
    inside = np.hypot(X - 80, Y - 60) < 40
    loud = wave(0.75, 0.02)
    loud.curvature[~inside] *= 100
    assert spectrum(loud, inside, MM)[2] == pytest.approx(0.02 / MM / np.sqrt(2), rel=0.15)


def relief(body, gel, seq):
    return ReliefMaker().relief(painted(bumps(), body, gel, seq=seq))


def test_what_moves_with_the_gel_lasts_and_what_slips_does_not():
    reference, rest = dots(), Motion()
    first, at_rest = relief(rest, rest, 0), field(rest, reference)
    gel = Motion(3.0, -2.0)
    stuck, slipped = relief(gel, gel, 1), relief(Motion(9.0, -2.0), gel, 1)
    mask = np.ones(first.curvature.shape, bool)
    (holds, moves), (lost, _) = (
        kept(first, second, mask, at_rest, field(gel, reference, 1), METRES_PER_PX) for second in (stuck, slipped)
    )
    assert moves
    assert holds > 0.9
    assert lost < holds - 0.3


def test_another_reference_tells_no_motion():
    first = relief(Motion(), Motion(), 0)
    mask = np.ones(first.curvature.shape, bool)
    assert kept(first, first, mask, field(Motion(), dots()), field(Motion(), dots(), 1), METRES_PER_PX) is None


def test_an_object_pressed_on_shows_its_relief_and_a_table_has_quartiles(tmp_path):
    free, pressed = painted(bumps() * 0, Motion(), Motion()).image, painted(bumps(), Motion(), Motion()).image
    write([free] * 3 + [pressed] * 9, tmp_path / "clip.avi", "FFV1")
    row = relief_row(tmp_path / "clip.avi")
    assert any(key.startswith("free") for key in row)
    table = relief_table({"real": [row, {"contact 0.5 to 1": 0.5}], "simulated": []})
    assert len(table) == 2 * (len(PLACES) * len(BANDS) + len(MOTIONS))
    own = next(r for r in table if (r["relief"], r["cycles_per_mm"], r["of"]) == ("contact", "0.5 to 1", "real"))
    assert own["clips"] >= 1
    assert all(r["p50"] is None and r["clips"] == 0 for r in table if r["of"] == "simulated")

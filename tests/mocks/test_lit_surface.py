"""Colour of a pressed gel: the calibration it was made from comes back, tiers part where they should, gels differ."""

import cv2
import numpy as np
import pytest
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.devices.look import look_of
from lsds_mocks.optics import specimen
from lsds_mocks.optics.background import AMBIENT, GRID_RGB, background
from lsds_mocks.optics.dots import DotPainter
from lsds_mocks.optics.lamps import SLOPE_TO_RGB, lamp_height_mm, lamps
from lsds_mocks.optics.noise import CameraNoise
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX, dot_positions
from lsds_mocks.optics.shading import Shader
from pydantic import ValidationError

PX_M = 0.0625e-3
BACKGROUND = background(0.0, np.random.default_rng(0))
X_M, Y_M = ((np.arange(n) - (n - 1) / 2) * PX_M for n in (WIDTH_PX, HEIGHT_PX))


def ball(x_mm, y_mm, radius_mm=4.0, depth_mm=0.35):
    """Depth (H, W) of a ball pressed in, with a shoulder of exponential decay around it, as a function of the axes."""

    def depth(x, y):
        r = np.hypot(x[None, :] - x_mm * 1e-3, y[:, None] - y_mm * 1e-3)
        edge = np.sqrt(2 * radius_mm * depth_mm) * 1e-3
        inside = depth_mm * 1e-3 - r * r / (2 * radius_mm * 1e-3)
        # Joins at 0.7 of the edge, with the slope it has there.
        join = 0.7 * edge
        height = depth_mm * 1e-3 - join**2 / (2 * radius_mm * 1e-3)
        slope = join / (radius_mm * 1e-3)
        return np.where(r < join, inside, height * np.exp(-(r - join) * slope / height)).astype(np.float32)

    return depth


def pressed(shape, tier="linear", **options):
    shader = Shader(BACKGROUND, PX_M, tier, **options)
    return shader.lit(shape(shader.x_m, shader.y_m)).astype(float)


def slopes(shape):
    depth = shape(X_M, Y_M)
    return np.gradient(depth, PX_M, axis=1), np.gradient(depth, PX_M, axis=0)


def test_lamps_are_on_the_bright_side_at_the_height_of_the_fall_off():
    heights = [lamp_height_mm(channel) for channel in range(3)]
    assert 10 < heights[0] < 30
    assert 30 < heights[2] < 60
    assert heights[1] >= 100  # green falls off by a per cent only
    # A point lamp of that height gives the fall-off back.
    for channel, sign in ((0, 1), (2, -1)):
        level = GRID_RGB[..., channel] - AMBIENT
        lean, h = abs(SLOPE_TO_RGB[channel, 1]) / level.mean(), heights[channel]
        p = sign * lean * h
        brightness = [((p - s) ** 2 + h * h) ** -1.5 for s in (-5.0, 5.0)]
        thirds = level.mean(axis=1)
        assert brightness[1] / brightness[0] == pytest.approx(thirds[2] / thirds[0], rel=1e-6)


def test_the_mean_answer_to_slopes_is_the_measured_one():
    directed = BACKGROUND - AMBIENT
    of = lamps(directed)
    middle = np.s_[30:210, 40:280]
    assert (directed * of.x)[middle].mean(axis=(0, 1)) == pytest.approx(SLOPE_TO_RGB[:, 0], abs=0.01)
    assert (directed * of.y)[middle].mean(axis=(0, 1)) == pytest.approx(SLOPE_TO_RGB[:, 1], abs=0.01)


@pytest.mark.parametrize("lift", [0.0, 6.0])
def test_calibrating_on_pressed_balls_gives_the_calibration_back(lift):
    """The procedure by which the nine coefficients were measured, on images with camera noise."""
    rng, noise = np.random.default_rng(3), CameraNoise(1.0, np.random.default_rng(4))
    rows, levels, off = [], [], []
    for seq in range(40):
        shape = ball(rng.uniform(-8, 8), rng.uniform(-5.5, 5.5))
        image = pressed(shape, lift_levels=lift).astype(np.uint8)
        image = noise.photograph(image, np.full_like(image, 255), 1.0, seq)
        gx, gy = slopes(shape)
        crop = shape(X_M, Y_M) > 0.1e-3
        change = (image.astype(float) - BACKGROUND)[crop]
        rows.append(np.stack([np.ones(crop.sum()), gx[crop], gy[crop]], axis=1))
        levels.append(change)
        off.append(change - lift - rows[-1][:, 1:] @ SLOPE_TO_RGB.T)
    rows, levels, off = np.concatenate(rows), np.concatenate(levels), np.concatenate(off)
    nine, *_ = np.linalg.lstsq(rows, levels, rcond=None)
    unexplained = levels - rows @ nine
    r2 = 1 - unexplained.var(axis=0) / levels.var(axis=0)
    print("offsets and slopes", nine.round(1).tolist(), "R2", r2.round(3), "L1", np.abs(off).mean().round(2))
    assert nine[0] == pytest.approx([lift] * 3, abs=1.5)
    found = nine[1:].T
    assert found == pytest.approx(SLOPE_TO_RGB, abs=10)
    assert (r2 > 0.7).all()
    # The measured calibration itself explains the contact's colours within these.
    assert np.abs(off).mean() <= 5.6
    assert 10 * np.log10(255**2 / (off**2).mean()) >= 31


def test_tiers_agree_on_gentle_slopes_and_part_on_steep_ones():
    gentle, steep = ball(2, 1, radius_mm=12, depth_mm=0.2), ball(2, 1, radius_mm=2, depth_mm=0.5)
    apart = [np.abs(pressed(s, "linear") - pressed(s, "full")).max() for s in (gentle, steep)]
    assert apart[0] <= 8
    assert apart[1] > 10


def test_colour_turned_away_from_a_lamp_is_dark_and_never_negative():
    cliff = pressed(
        lambda x, y: np.broadcast_to(2.5 * (y[:, None] - y[0]), (len(y), len(x))).astype(np.float32), "full"
    )
    middle = cliff[100:140, 100:220]
    assert middle[..., 0].max() < BACKGROUND[100:140, 100:220, 0].min()
    assert middle[..., 0].min() >= AMBIENT - 12


def test_a_quarter_of_the_resolution_is_enough_for_a_smooth_surface():
    shape = ball(-3, 2)
    coarse, fine = pressed(shape), pressed(shape, reduction=1)
    assert np.abs(coarse - fine).mean() < 0.2
    assert np.sqrt(((coarse - fine) ** 2).mean()) < 0.8


def test_markers_only_shows_no_contact():
    shader = Shader(BACKGROUND, PX_M, "markers")
    shown = shader.shade(None, ball(0, 0), True)
    assert np.array_equal(shown, np.clip(np.rint(BACKGROUND), 0, 255))


def test_background_is_positive_and_dim_at_the_upper_edge_as_recorded():
    assert BACKGROUND.min() > 15
    assert BACKGROUND[3, 160, 0] == pytest.approx(45, abs=10)


# -- gels ------------------------------------------------------------------------------------------------


def test_numbered_gels_lie_in_the_measured_ranges_and_fill_them():
    gels = [specimen.draw(n) for n in range(300)]
    for values, (low, high) in (
        ([g.dot_diameter_px for g in gels], specimen.DIAMETER_PX),
        ([g.dot_core for g in gels], specimen.CORE),
        ([g.brightness for g in gels], specimen.BRIGHTNESS),
    ):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high >= max(values) > high - 0.05 * (high - low)
    pitches = []
    for gel in gels:
        grid = dot_positions("7x9", 0.0, np.random.default_rng(0), gel.pitch).reshape(7, 9, 2)
        pitches.append((np.diff(grid[:, :, 0], axis=1).mean(), np.diff(grid[:, :, 1], axis=0).mean()))
    pitches = np.array(pitches)
    assert pitches.min(axis=0) == pytest.approx([32.5, 31.5], abs=0.1)
    assert pitches.max(axis=0) == pytest.approx([33.7, 32.9], abs=0.1)
    assert specimen.draw(7) == specimen.draw(7)


def test_options_override_the_numbered_gel():
    look, set_look = look_of(GelSightOptions(gel=7)), look_of(GelSightOptions(gel=7, dot_diameter_px=9.0, wear=0.0))
    assert look.dot_diameter_px == specimen.draw(7).dot_diameter_px
    assert look.pitch == specimen.draw(7).pitch
    assert set_look.dot_diameter_px == 9.0
    assert set_look.wear == 0.0
    assert set_look.brightness == look.brightness
    assert look_of(GelSightOptions()).dot_diameter_px == 13.0
    with pytest.raises(ValidationError):
        GelSightOptions(gel=-1)


def test_worn_dots_are_paler():
    ink = specimen.ink(63, 0.5, np.random.default_rng(0))
    assert 0.3 <= ink.min() < 0.9
    assert 20 < np.count_nonzero(ink < 1) < 43
    assert (specimen.ink(63, 0.0, np.random.default_rng(0)) == 1).all()
    cover = DotPainter(13.0, 0.31, 0.9, np.array([1.0, 0.5])).paint(np.array([[100.0, 100.0], [200.0, 100.0]]))
    assert cover[100, 100] == pytest.approx(0.31 * 255, abs=2)
    assert cover[100, 200] == pytest.approx((1 - 0.5 * 0.69) * 255, abs=2)


def test_dust_darkens_little_of_a_worn_gel_and_none_of_a_new_one():
    new, worn = BACKGROUND.copy(), BACKGROUND.copy()
    specimen.dust(new, 0.0, np.random.default_rng(1))
    specimen.dust(worn, 0.9, np.random.default_rng(1))
    assert np.array_equal(new, BACKGROUND)
    darker = (worn < 0.95 * BACKGROUND).mean()
    assert 0 < darker < 0.01


def test_overlapping_dots_show_the_darker_one():
    painter = DotPainter(13.0, 0.31, 0.9)
    one = painter.paint(np.array([[100.0, 100.0]])).copy()
    other = painter.paint(np.array([[106.0, 103.0]])).copy()
    both = painter.paint(np.array([[100.0, 100.0], [106.0, 103.0]]))
    assert np.array_equal(both, np.minimum(one, other))
    assert cv2.countNonZero(255 - both) > cv2.countNonZero(255 - one)


def test_a_lamp_that_fades_a_little_moves_no_contours_over_the_image():
    """Block means follow the gain everywhere alike: noise comes before counting, in a camera."""
    noise = CameraNoise(1.0, np.random.default_rng(4))
    lit = np.clip(BACKGROUND, 0, 255).astype(np.uint8)
    ink = np.full_like(lit, 255)

    def blocks(gain):
        frames = [noise.photograph(lit, ink, gain, seq) for seq in range(200)]
        return np.mean([frame.reshape(48, 5, 64, 5, 3).mean(axis=(1, 3)) for frame in frames], axis=0)

    change = blocks(0.998) - blocks(1.0)
    expected = -0.002 * lit.reshape(48, 5, 64, 5, 3).mean(axis=(1, 3))
    assert np.abs(change - expected).max() < 0.1

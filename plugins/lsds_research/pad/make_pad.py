"""Compute the finite-pad correction of a gel pad: `python -m lsds_research.pad.make_pad`.

Method and accuracy: `lsds_mocks.gel.field.correction` and docs/decisions/0012-the-pad-correction.md.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import click
from lsds_mocks.gel.material import GelMaterial

from lsds.cli.main import run_command
from lsds.cli.output import require_writable
from lsds.errors import DataError

RATIOS = (0.3, 0.4, 0.48, 0.499)
"""Marker motion is interpolated between these Poisson ratios to 0.01 %."""
_PAD = GelMaterial()
_SIZES = (1.0, 10.0)
"""Allowed width and height in thicknesses. A smaller pad is a post; for a larger one the matrices become too large."""
_RATIO = (0.05, 0.4999)
"""Allowed range of Poisson's ratio, below the incompressible 0.5; chosen."""
_RATIO_DISTANCE = 1e-3
"""Minimum difference of two Poisson's ratios of one file; chosen."""
_PROGRESS_STEPS = 1000
"""Number of steps of the progress bar; chosen."""


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option("--width-mm", type=float, default=_PAD.width_m * 1e3, show_default=True, help="Size of the gel along x.")
@click.option(
    "--height-mm", type=float, default=_PAD.height_m * 1e3, show_default=True, help="Size of the gel along y."
)
@click.option(
    "--thickness-mm", type=float, default=_PAD.thickness_m * 1e3, show_default=True, help="Thickness of the gel."
)
@click.option(
    "--poisson",
    "ratios",
    type=float,
    multiple=True,
    default=RATIOS,
    show_default=True,
    help="Poisson ratio; repeatable.",
)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), required=True, help="File to write: .npz.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
@click.option("--coarse", is_flag=True, help="Use few elements: fast, with errors of some per cent.")
def make_pad(
    width_mm: float,
    height_mm: float,
    thickness_mm: float,
    ratios: tuple[float, ...],
    out: Path,
    force: bool,
    coarse: bool,
) -> None:
    """Compute the effect of a gel pad's side walls on its compliance by finite elements, and write it to a file.

    The result is valid for all pads of the same proportions, independent of size and modulus, and for Poisson ratios
    between the smallest and the largest given; four ratios are enough. For the shipped pad, one ratio takes about five
    minutes on one core and 3 GB of memory with PARDISO, and more without. Needs SciPy: pip install 'lsds-tactile[pad]'.

    \b
    Examples:
      python -m lsds_research.pad.make_pad --out pad.npz --coarse                      a quick trial
      python -m lsds_research.pad.make_pad --width-mm 26 --height-mm 21 --out pad.npz  a larger pad
      python -m lsds_research.pad.make_pad --thickness-mm 3 --poisson 0.47 --poisson 0.49 --out pad.npz
    """
    _require_sensible(width_mm, height_mm, thickness_mm, ratios)
    if out.exists() and not force:
        raise click.UsageError(f"--out {out}: the file exists; --force replaces it")
    require_writable(out)
    from lsds_mocks.gel.field.correction import write
    from lsds_mocks.gel.field.grid import hat_grid

    from lsds_research.pad.fem.assemble import make
    from lsds_research.pad.fem.mesh import COARSE, FINE

    pad = GelMaterial(thickness_m=thickness_mm * 1e-3, width_m=width_mm * 1e-3, height_m=height_mm * 1e-3)
    done = 0.0
    label = f"{len(ratios)} Poisson ratio" + ("s" if len(ratios) > 1 else "")
    with click.progressbar(length=_PROGRESS_STEPS, label=label, file=sys.stderr) as bar:

        def progress(part: float) -> None:
            nonlocal done
            done += part
            bar.update(round(done * _PROGRESS_STEPS) - bar.pos)

        content = make(hat_grid(pad), sorted(ratios), COARSE if coarse else FINE, progress)
    try:
        write(out, content)
    except OSError as error:
        raise DataError(f"{out}: cannot be written: {error.strerror}") from error
    click.echo(f"wrote {out}, {out.stat().st_size / 1e6:.1f} MB; name it as the gel's pad_correction", err=True)


def _require_sensible(width_mm: float, height_mm: float, thickness_mm: float, ratios: Sequence[float]) -> None:
    """Raise click.UsageError for a pad or a ratio out of range."""
    # Written so that NaN fails, too.
    if not 0.05 <= thickness_mm <= 1000:
        raise click.UsageError(f"--thickness-mm {thickness_mm:g}: a gel is 0.05 to 1000 mm thick")
    low, high = _SIZES
    for name, size_mm in (("--width-mm", width_mm), ("--height-mm", height_mm)):
        if not low * thickness_mm <= size_mm <= high * thickness_mm:
            raise click.UsageError(
                f"{name} {size_mm:g}: a pad of {thickness_mm:g} mm is "
                f"{low * thickness_mm:g} to {high * thickness_mm:g} mm wide and high"
            )
    for ratio in ratios:
        if not _RATIO[0] <= ratio <= _RATIO[1]:
            raise click.UsageError(f"--poisson {ratio:g}: a ratio is between {_RATIO[0]:g} and {_RATIO[1]:g}")
    for one, next_one in pairwise(sorted(ratios)):
        if next_one - one < _RATIO_DISTANCE:
            raise click.UsageError(f"--poisson {one:g} and {next_one:g}: ratios are at least {_RATIO_DISTANCE:g} apart")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; an expected error is one message on stderr."""
    return run_command(make_pad, "python -m lsds_research.pad.make_pad", arguments)


if __name__ == "__main__":
    sys.exit(main())

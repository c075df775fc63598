"""`lsds learn label`: label slip by eye, frame by frame."""

from __future__ import annotations

import getpass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.text_table import table

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from lsds_research.slips.labels import Labels
    from lsds_research.slips.marking import Marking
    from lsds_research.slips.recording_view import RecordingView


@click.command()
@click.argument("videos", nargs=-1, required=True, type=click.Path(exists=True, path_type=Path))
@click.option(
    "--labels",
    "file",
    type=click.Path(dir_okay=False, path_type=Path),
    default=None,
    help="File of labels to continue; default: slip_labels.csv next to the first recording.",
)
@click.option("--labeller", default="", metavar="NAME", help="Name of the labeller; default: the login name.")
@click.option(
    "--pictures",
    type=click.Path(file_okay=False, path_type=Path),
    default=None,
    metavar="DIR",
    help="Write kymographs and strips as PNG instead of opening a window.",
)
@click.option(
    "--compare",
    "other",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    default=None,
    metavar="FILE",
    help="Print the agreement with the labels in FILE instead.",
)
@json_option
def label(
    videos: tuple[Path, ...],
    file: Path | None,
    labeller: str,
    pictures: Path | None,
    other: Path | None,
    json_file: str | None,
) -> None:
    """Label slip in VIDEOS by eye, frame by frame: free, stick, slip, touch or unsure.

    VIDEOS are video files or folders of images. Slip is the object's imprint moving against the gel. The window shows
    the imprint in coordinates that are fixed to the gel: an object that sticks is straight in the kymograph and stays
    on the grid lines in the strip. The command saves every change at once. The protocol is in docs/labelling.md. Needs
    the plot extra, and a screen unless --pictures or --compare is given.

    Takes: as long as you label; seconds with --pictures or --compare.

    Writes: slip_labels.csv (--labels), or PNG files to the folder of --pictures.

    \b
    Examples:
      lsds learn label recordings/mug.avi
      lsds learn label recordings/*.avi --pictures looks      # label from PNG
      lsds learn label recordings/*.avi --compare second.csv  # compare labellers
    """
    from lsds_research.slips.labels import NAME, read_labels

    file = file or videos[0].parent / NAME
    require_writable(json_file)
    labels: Labels = read_labels(file) if file.exists() or other is not None else {}
    if other is not None:
        _compare(labels, read_labels(other), videos, json_file)
    elif pictures is not None:
        _draw(videos, pictures)
    else:
        require_writable(file)
        _window(videos, labels, file, labeller or getpass.getuser())


def _compare(labels: Labels, other: Labels, videos: tuple[Path, ...], json_file: str | None) -> None:
    import dataclasses

    from lsds_research.slips.agreement import agreement
    from lsds_research.slips.labels import name_of

    names = {name_of(video.absolute()) for video in videos}
    found = agreement({k: v for k, v in labels.items() if k in names}, {k: v for k, v in other.items() if k in names})
    summary = dataclasses.asdict(found)
    if json_file is not None:
        write_json(summary, json_file)
    if json_file != "-":
        rows = [
            ("videos labelled twice", str(found.videos)),
            ("frames that both labelled with confidence", str(found.frames)),
            ("of these labelled the same (slip or not)", f"{found.same:.3f}"),
            ("Cohen's kappa", f"{found.kappa:.3f}"),
            ("intervals of slip of either labeller", str(found.intervals)),
            ("of these labelled by both", str(found.both)),
        ]
        click.echo(table(rows, ("agreement", "")))


def _draw(videos: tuple[Path, ...], folder: Path) -> None:
    from lsds_research.slips.pictures import STRIP, kymograph, strip

    for seen in _seen(videos):
        place = folder / seen.name
        _write(place / "kymograph.png", kymograph(seen))
        for first, last in seen.moving():
            for begin in range(first, last + 1, STRIP):
                end = min(begin + STRIP - 1, last)
                _write(place / f"strip_{begin:04}-{end:04}.png", strip(seen, begin, end))
        click.echo(f"{place}: {len(seen)} frames, motion in {len(seen.moving())} ranges")


def _write(file: Path, picture: NDArray[np.uint8]) -> None:
    import cv2

    from lsds.support.files import write_whole

    write_whole(file, cv2.imencode(".png", picture[..., ::-1])[1].tobytes())


def _window(videos: tuple[Path, ...], labels: Labels, file: Path, labeller: str) -> None:
    from lsds.errors import DataError
    from lsds.support.extras import require
    from lsds_research.slips.labels import write_labels
    from lsds_research.slips.marking import Marking

    require("matplotlib", extra="plot", purpose="labelling in a window")
    import matplotlib
    import matplotlib.pyplot as plt

    from lsds_research.slips.window import LabelWindow

    if matplotlib.get_backend().lower() in ("agg", "pdf", "svg", "ps", "cairo", "template"):
        raise DataError("no window can be opened here (use a screen, or --pictures DIR and write the CSV by hand)")
    for seen in _seen(videos):

        def save(marking: Marking, name: str = seen.name) -> None:
            labels[name] = marking.intervals
            write_labels(file, labels)

        LabelWindow(seen, Marking(len(seen), labels.get(seen.name, ()), labeller), save)
        plt.show()


def _seen(videos: tuple[Path, ...]) -> Iterator[RecordingView]:
    from lsds.cli.progress import Progress
    from lsds_research.slips.recording_view import RecordingView

    for number, video in enumerate(videos, start=1):
        with Progress(f"reading {video.name} ({number} of {len(videos)})") as progress:
            seen = RecordingView(video, progress.to)
        yield seen

"""Draw docs/images/house.png from the import graph: `python docs/house.py` (needs the dev extra).

A room is a package, or a module or folder at the top of the core; an arrow runs from who imports to what is
imported. Rooms stand on floors, and every arrow points down. An arrow is left out if a longer way leads to the same
room, and so are those to the ground floor, which all stand on.
"""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

from lsds.session.pictures.figure import new_figure

ROOT = Path(__file__).resolve().parents[1]
HOMES = {
    "lsds": ROOT / "lsds",
    "lsds_plugins": ROOT / "plugins" / "lsds_plugins",
    "lsds_research": ROOT / "plugins" / "lsds_research",
    "lsds_drivers": ROOT / "drivers" / "lsds_drivers",
    "lsds_mocks": ROOT / "mocks" / "lsds_mocks",
}
FLOORS: tuple[dict[str, float], ...] = (
    {"lsds_research": 0.50},
    {"lsds_plugins": 0.12, "lsds_mocks": 0.41, "lsds_drivers": 0.88},
    {"lsds.cli": 0.55},
    {"lsds.calibration": 0.46, "lsds.testing": 0.87},
    {"lsds.session": 0.42},
    {"lsds.runtime": 0.37},
    {"lsds.config": 0.62},
    {"lsds.jobs": 0.12, "lsds.registry": 0.66, "lsds.models": 0.93},
    {"lsds.grip": 0.37},
    {"lsds.tactile": 0.37},
    {"lsds.safety": 0.37},
    {"lsds.contracts": 0.37},
    {"lsds.support": 0.37},
    {"lsds.errors": 0.27, "lsds.clock": 0.47},
)
"""Rooms of each floor from top to bottom, with their place across: no arrow may run behind another room."""
ROOMS = [room for floor in FLOORS for room in floor]
GROUND = ("lsds.contracts", "lsds.support", "lsds.errors", "lsds.clock")
LINE = (("lsds.runtime", "lsds.grip"), ("lsds.grip", "lsds.tactile"), ("lsds.tactile", "lsds.safety"))
CONTENTS = {
    "lsds_research": "datasets, collecting, learners, evaluation, studies",
    "lsds_plugins": "trackers, detectors, estimators,\ncontrollers, jobs, replay",
    "lsds_mocks": "the simulated cell and\nits devices' wire faces",
    "lsds_drivers": "real hardware",
    "lsds.cli": "the command line",
    "lsds.testing": "conformance checks of plugins",
    "lsds.calibration": "calibration on the user's own cell",
    "lsds.session": "one run: bring-up, record, summary, pictures",
    "lsds.runtime": "the engine: from the newest frame to the command",
    "lsds.config": "TOML to validated options",
    "lsds.jobs": "grasp, take up, probe, hold, watch",
    "lsds.registry": "discovery of plugins",
    "lsds.models": "running trained models",
    "lsds.grip": "belief: load, friction limit, slip",
    "lsds.tactile": "image to markers, field, imprint, load, touch",
    "lsds.safety": "limits, monitors, call deadlines, validation",
    "lsds.contracts": "Protocols, and the values that cross them",
    "lsds.support": "files, extras, processes",
}


def room_of(module: str) -> str:
    """Return the room that a module is in, empty for none that is drawn."""
    found = [room for room in ROOMS if module == room or module.startswith(room + ".")]
    return max(found, key=len, default="")


def imports(path: Path) -> set[str]:
    """Return the modules that a file imports at run time: what only a type checker reads is left out."""
    found = set()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typed = [node for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)]
    skipped = {id(inner) for node in typed for inner in ast.walk(node)}
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def arrows() -> Counter[tuple[str, str]]:
    """Return how many files of one room import another."""
    counted: Counter[tuple[str, str]] = Counter()
    for package, home in HOMES.items():
        for path in home.rglob("*.py"):
            module = ".".join([package, *path.relative_to(home).with_suffix("").parts]).removesuffix(".__init__")
            here = room_of(module)
            for there in {room_of(name) for name in imports(path)} - {here, ""}:
                if here:
                    counted[here, there] += 1
    return counted


def upward(counted: Counter[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the arrows that do not point down."""
    floor = {room: level for level, rooms in enumerate(FLOORS) for room in rooms}
    return [(here, there) for here, there in counted if floor[here] >= floor[there]]


def direct(counted: Counter[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the arrows that no longer way makes superfluous (transitive reduction), without those to the ground."""
    ways = {here: {b for a, b in counted if a == here and b not in GROUND} for here in ROOMS}

    def reaches(here: str, there: str) -> bool:
        return there in ways[here] or any(reaches(via, there) for via in ways[here])

    return [(a, b) for a in ROOMS for b in sorted(ways[a]) if not any(reaches(via, b) for via in ways[a] - {b})]


def draw(path: Path) -> None:
    """Write the picture."""
    figure = new_figure(12, 11)
    axes = figure.subplots()
    frames, place = {}, {}
    for level, rooms in enumerate(FLOORS):
        for room, x in rooms.items():
            core = room.startswith("lsds.")
            text = f"{room}\n{CONTENTS[room]}" if room in CONTENTS else room
            box = {"boxstyle": "round,pad=0.5", "fc": "#eaf2fb" if core else "#fdf1e2", "ec": "0.3", "lw": 0.8}
            weight = "bold" if room in {end for arrow in LINE for end in arrow} else "normal"
            shown = axes.text(x, -level, text, ha="center", va="center", fontsize=8.5, bbox=box, weight=weight)
            frames[room], place[room] = shown, (x, -level)
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-len(FLOORS) + 0.4, 0.6)
    axes.axis("off")
    axes.set_title("Who imports whom. Bold: the rooms that a frame passes. Blue boxes: the core.", fontsize=10)
    # The frames of the texts get their size when the figure is drawn; arrows end at them.
    figure.canvas.draw()
    for here, there in dict.fromkeys([*direct(arrows()), *LINE]):
        bold = (here, there) in LINE
        style = {"arrowstyle": "-|>", "color": "#2c6fbb" if bold else "0.5", "lw": 2.2 if bold else 0.9}
        ends = {"patchA": frames[here].get_bbox_patch(), "patchB": frames[there].get_bbox_patch()}
        axes.annotate("", place[there], place[here], arrowprops=style | ends | {"shrinkA": 0, "shrinkB": 1}, zorder=0)
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    draw(ROOT / "docs" / "images" / "house.png")
    print(upward(arrows()) or "every arrow points down")

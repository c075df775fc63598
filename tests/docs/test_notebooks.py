"""The notebooks of docs/notebooks run, as scripts and in a Jupyter kernel, and show what their text states."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import lsds
from tests.house_rules import english

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "notebooks"
NOTEBOOKS = ("first_lift", "test_a_driver")
MOST_LINES = 40
"""Maximum number of lines of a cell."""

PROBES = {
    "first_lift": """
def drawn(figure):
    return [[[float(y) for y in line.get_ydata()] for line in axes.lines] for axes in figure.axes]

results = {
    "sentences": {name: run.verdict.sentence for name, run in runs.items()},
    "verdicts": verdicts["outcome"].to_dict(),
    "slips": len(slips),
    "lift": drawn(lift_figure),
    "drop": drawn(drop_figure),
}
""",
    "test_a_driver": """
results = {
    "healthy": healthy,
    "delay_s": delay_s,
    "error": str(failure[1]),
    "lines": {line.get_label(): [list(map(float, axis)) for axis in line.get_data()] for line in axes.lines},
    "writes": [(1e-9 * (frame.t_ns - began_ns), frame.meaning) for frame in sent],
    "delays_s": delays_s,
    "stale_m": last_readings[-1][1],
}
""",
}
"""Code that collects results from the variables of a notebook."""


def cells(name, kind):
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == kind]


def run_as_script(name, folder):
    """Return what the probe prints at the end of all cells as one script in a fresh process."""
    script = folder / f"{name}.py"
    code = [*cells(name, "code"), PROBES[name], "import json", "print(json.dumps(results))"]
    script.write_text("\n\n".join(code), encoding="utf-8")
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout.splitlines()[-1])


IN_A_KERNEL = """
import json, sys
import nbformat
from nbclient import NotebookClient

source, probe = sys.argv[1:]
notebook = nbformat.read(source, as_version=4)
nbformat.validate(notebook)
notebook.cells.append(nbformat.v4.new_code_cell(probe))
NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
pictures = sum("image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", ()))
print(json.dumps({**json.loads(notebook.cells[-1].outputs[-1].text), "pictures": pictures}))
"""


def run_in_a_kernel(name, folder):
    """Return what the probe prints in the kernel, and the number of pictures that the cells display."""
    for module in ("nbclient", "nbformat", "ipykernel"):
        pytest.importorskip(module, reason=f"{module} is not installed; it comes with the extra 'dev'")
    probe = f"{PROBES[name]}\nimport json\nprint(json.dumps(results))"
    environment = {key: value for key, value in os.environ.items() if key != "MPLBACKEND"}
    command = [sys.executable, "-c", IN_A_KERNEL, str(FOLDER / f"{name}.ipynb"), probe]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.usefixtures("installed_host")
@pytest.mark.parametrize("run", [run_as_script, run_in_a_kernel])
def test_the_first_lift_holds_the_pipe_and_shows_it(run, tmp_path):
    pytest.importorskip("pandas", reason="pandas is not installed; it comes with the extra 'data'")
    results = run("first_lift", tmp_path)
    assert results["verdicts"] == {
        "pipe, fused": "held",
        "pipe, no controller": "dropped",
        "bottle, fused": "held",
        "bottle, threshold": "held",
    }
    assert results["sentences"]["pipe, fused"].startswith("held: with ")
    assert results["slips"] > 3
    for picture in ("lift", "drop"):
        assert all(len(line) > 50 for axes in results[picture] for line in axes)
    (estimate, true_speed), (grip, needed) = results["lift"]
    # mm/s and N.
    assert 5 < max(true_speed) < 20
    assert 5 < max(filter(lambda speed: speed == speed, estimate)) < 20
    assert max(grip) > grip[-1] > needed[-1] > 1
    _, (grip, needed) = results["drop"]
    assert grip[-1] < needed[-1]
    assert results.get("pictures", 2) == 2


@pytest.mark.parametrize("run", [run_as_script, run_in_a_kernel])
def test_the_driver_meets_its_safety_property_under_a_fault(run, tmp_path):
    pytest.importorskip("pymodbus", reason="pymodbus is not installed; it comes with the extra 'robotiq'")
    results = run("test_a_driver", tmp_path)
    read_m, true_m = results["healthy"]
    assert read_m == pytest.approx(true_m, abs=0.00023)  # m, a tick of the position register
    assert 0.25 < results["delay_s"] < 1.0
    assert "no status for" in results["error"]
    # Times since the fault began (s), and apertures (mm).
    _, apertures = results["lines"]["plant"]
    assert apertures == sorted(apertures, reverse=True)
    assert apertures[-1] < 20.0
    read_times, read_apertures = results["lines"]["driver"]
    assert max(read_times) == pytest.approx(results["delay_s"], abs=0.2)
    assert read_apertures[-1] > apertures[-1] + 5.0
    # The fault lasts 1.5 s.
    first_s, first = results["writes"][0]
    assert first == "write 1000: 0x0100"
    assert first_s > 1.49
    # The text states that this driver notices a freeze during a motion after half a second.
    assert 0.4 < results["delays_s"].pop("freeze") < 1.0
    assert results["stale_m"] > 0.025
    assert results["delays_s"].keys() == {"corrupt", "disconnect"}
    assert all(delay_s < 1.0 for delay_s in results["delays_s"].values())
    assert results.get("pictures", 1) == 1


def test_every_notebook_has_a_test_and_a_link():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(NOTEBOOKS)
    page = (ROOT / "docs" / "notebooks.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\]\(notebooks/(\w+)\.ipynb\)", page)) == set(NOTEBOOKS)


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_stored_without_outputs_in_short_cells(name):
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert 6 <= len(code) <= 10
    assert [cell["id"] for cell in code if cell["outputs"] or cell["execution_count"] is not None] == []
    assert [cell["id"] for cell in notebook["cells"] if len(cell["source"]) > MOST_LINES] == []
    assert notebook["metadata"].keys() == {"kernelspec", "language_info"}


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_links_pages_that_exist(name):
    links = re.findall(r"\]\(([^)]+)\)", "\n".join(cells(name, "markdown")))
    assert links
    assert [link for link in links if not (FOLDER / link).exists()] == []


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_uses_only_names_of_the_reference(name):
    pages = (ROOT / "docs" / "reference").glob("*.md")
    modules = {
        module
        for page in pages
        for module in re.findall(r"^::: ([\w.]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    }
    nodes = list(ast.walk(ast.parse("\n".join(cells(name, "code")))))
    imports = [node for node in nodes if isinstance(node, ast.ImportFrom) and node.module.startswith("lsds")]
    names = {node.attr for node in nodes if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "lsds"}
    private = [node.attr for node in nodes if isinstance(node, ast.Attribute) and node.attr.startswith("_")]
    assert names
    assert [node.module for node in imports if node.module not in modules] == []
    assert names <= set(lsds.__all__)
    assert private == []


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_written_in_the_words_of_the_field(name, tmp_path):
    (tmp_path / "text.md").write_text("\n".join(cells(name, "markdown")), encoding="utf-8")
    (tmp_path / "code.py").write_text("\n".join(cells(name, "code")), encoding="utf-8")
    assert [*english.places(tmp_path / "text.md"), *english.places(tmp_path / "code.py")] == []

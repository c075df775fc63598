"""`lsds new`: names, folders, warnings, and what it prints."""

from __future__ import annotations

import pytest

from lsds.cli.main import main
from lsds.cli.scaffold.names import names_of
from lsds.cli.scaffold.plan import PLANS
from lsds.contracts import KINDS
from lsds.errors import ConfigError

pytest.importorskip("jinja2")


def test_it_writes_a_distribution_and_prints_what_comes_next(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "detector", "acme-area"]) == 0
    out = capsys.readouterr().out
    assert out.endswith(
        "next:\n  cd lsds-acme-area\n  pip install -e '.[dev]'\n  pytest\n  lsds run --set detector.backend=acme-area\n"
    )
    folder = tmp_path / "lsds-acme-area"
    for file in ("pyproject.toml", "README.md", ".github/workflows/test.yml", "src/lsds_acme_area/manifest.py"):
        assert (folder / file).is_file()
        assert f"lsds-acme-area/{file}" in out
    assert not (folder / "LICENSE").exists()
    assert "class AcmeAreaDetector" in (folder / "src/lsds_acme_area/detector.py").read_text()


def test_another_distribution_and_folder(tmp_path):
    arguments = ["--distribution", "acme-tools", "--out", str(tmp_path / "deep" / "here")]
    assert main(["new", "gripper", "acme-2f", *arguments]) == 0
    assert (tmp_path / "deep" / "here" / "src" / "acme_tools" / "driver.py").is_file()


def test_a_folder_that_is_not_empty_is_left_alone_without_force(tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    command = ["new", "job", "acme-job", "--out", str(tmp_path)]
    assert main(command) == 5
    assert "is not empty (choose another folder with --out, or overwrite with --force)" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    assert main([*command, "--force"]) == 0
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert main(["new", "job", "acme-job", "--out", str(tmp_path / "mine.txt")]) == 5


@pytest.mark.parametrize(
    ("name", "distribution", "problem"),
    [
        ("Acme", "", "NAME: 'Acme' is not a valid name"),
        ("2f", "", "NAME: '2f' is not a valid name"),
        ("acme:2f", "", "not a valid name"),
        ("../acme", "", "not a valid name"),
        ("a" * 31, "", "at most 30 characters"),
        ("none", "", "NAME: 'none' is reserved"),
        ("acme", "json", "--distribution: 'json' is the name of an existing package"),
        ("acme", "lsds-mocks", "'lsds_mocks' is the name of an existing package"),
        ("acme", "class", "'class' is the name of an existing package"),
        ("tactile", "", "--distribution: 'lsds_tactile' is the name of an existing package"),
        ("acme", "Acme Tools", "--distribution: 'Acme Tools' is not a valid name"),
    ],
)
def test_names_that_cannot_be_are_refused(name, distribution, problem):
    with pytest.raises(ConfigError, match=problem):
        names_of("gripper", name, distribution)


@pytest.mark.usefixtures("installed_host")
def test_a_name_that_is_claimed_is_a_warning(tmp_path, capsys):
    assert main(["new", "tracker", "lk", "--out", str(tmp_path)]) == 0
    warning = "warning: tracker 'lk' is offered by lsds-tactile already; a config then has to name DISTRIBUTION:NAME"
    assert warning in capsys.readouterr().err


def test_without_jinja_the_remedy_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("lsds.support.extras.importable", lambda name: name != "jinja2")
    assert main(["new", "job", "acme-job", "--out", str(tmp_path / "job")]) == 3
    assert "lsds new needs jinja2, which is not installed; install with: pip install 'lsds-tactile[new]'" in (
        capsys.readouterr().err
    )
    assert not (tmp_path / "job").exists()


def test_every_kind_but_two_has_a_scaffold(capsys):
    assert set(KINDS) - set(PLANS) == {"cell", "learner"}
    assert main(["new", "--help"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert all(kind in out for kind in PLANS)
    assert main(["new", "cell", "acme"]) == 2

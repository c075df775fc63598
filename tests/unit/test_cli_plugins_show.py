"""`lsds plugins show NAME`: the kind, requirements, contract and options of one backend."""

from __future__ import annotations

import json

import pytest
from fake_cell import fake_host, plugin

from lsds.cli import plugin_show
from lsds.cli import plugins as plugins_module
from lsds.cli.main import main
from lsds.contracts import BackendSpec
from lsds.registry.backends import OWN_DISTRIBUTION
from lsds.registry.describe import unit_of


@pytest.fixture(autouse=True)
def _fakes(monkeypatch):
    def host():
        made = fake_host()
        made.register(
            plugin(
                BackendSpec("arm", "gone", "no_module:a", "no_module:b"),
                BackendSpec("sensor", "fake-gripper", "m:a", requires=("no_such_library",), extra="cam"),
            ),
            distribution="acme",
        )
        own = BackendSpec("gripper", "own-gripper", "m:a", requires=("no_such_library",), extra="cam")
        made.register(plugin(own), distribution=OWN_DISTRIBUTION)
        return made

    for module in (plugins_module, plugin_show):
        monkeypatch.setattr(module, "PluginHost", host)


def shown(capsys, *arguments):
    assert main(["plugins", "show", *arguments]) == 0
    return capsys.readouterr().out


def test_text_of_a_backend(capsys):
    out = shown(capsys, "real-gripper")
    assert "gripper 'real-gripper' of fakes" in out
    assert "Hand-E, 2024-05-01" in out
    assert "command(command)" in out
    (line,) = [line for line in out.splitlines() if line.strip().startswith("latency_ms")]
    assert "ms" in line.split()


def test_json_of_a_backend(capsys):
    (found,) = json.loads(shown(capsys, "fakes:fake-gripper", "--json"))["backends"]
    assert (found["kind"], found["name"], found["distribution"]) == ("gripper", "fake-gripper", "fakes")
    assert "read()" in found["members"]
    assert "spec" in found["members"]
    latency = next(option for option in found["options"] if option["name"] == "latency_ms")
    assert set(latency) == {"name", "type", "default", "required", "description", "unit"}
    assert latency["unit"] == "ms"
    assert found["options_problem"] == ""


def test_a_name_of_several_kinds_and_one_kind_of_them(capsys):
    both = json.loads(shown(capsys, "fake-gripper", "--json"))["backends"]
    assert [backend["kind"] for backend in both] == ["gripper", "sensor"]
    (one,) = json.loads(shown(capsys, "fake-gripper", "--kind", "sensor", "--json"))["backends"]
    assert one["missing"] == ["no_such_library"]
    assert "pip install 'acme[cam]'" in shown(capsys, "acme:fake-gripper")


@pytest.mark.parametrize("prefix", ["lsds", "lsds-tactile"])
def test_first_party_backends_have_two_prefixes_and_the_distribution_that_pip_knows(capsys, prefix):
    out = shown(capsys, f"{prefix}:own-gripper")
    assert out.startswith("gripper 'own-gripper' of lsds-tactile\n")
    assert "pip install 'lsds-tactile[cam]'" in out


def test_options_that_cannot_be_imported(capsys):
    out = shown(capsys, "gone", "--kind", "arm")
    (line,) = [line for line in out.splitlines() if "importing 'no_module:b' failed" in line]
    assert "pip install -U acme" in line
    (found,) = json.loads(shown(capsys, "acme:gone", "--json"))["backends"]
    assert found["options"] == []
    assert "no_module" in found["options_problem"]


def test_an_unknown_name_comes_with_a_suggestion(capsys):
    assert main(["plugins", "show", "fake-griper"]) == 3
    assert capsys.readouterr().err == (
        "error: no installed plugin offers 'fake-griper'; did you mean 'fake-gripper'? lsds plugins lists all\n"
    )
    assert main(["plugins", "shwo"]) == 2
    assert "Did you mean 'show'?" in capsys.readouterr().err


def test_the_list_takes_its_flags_as_before(capsys, tmp_path):
    assert main(["plugins", "--kind", "arm", "--json", str(tmp_path / "x.json")]) == 0
    assert {b["kind"] for b in json.loads((tmp_path / "x.json").read_text())["backends"]} == {"arm"}
    assert main(["plugins", "--help"]) == 0
    assert "show" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("rate_hz", "Hz"),
        ("force_n", "N"),
        ("gap_mm", "mm"),
        ("speed_mm_per_s", "mm/s"),
        ("port", ""),
        ("s", ""),
        ("speed_m_s", "m/s"),
        ("stiffness_n_mm", "N/mm"),
    ],
)
def test_the_unit_is_the_end_of_the_name(name, unit):
    assert unit_of(name, None) == unit
    assert unit_of(name, {"unit": "furlong"}) == "furlong"

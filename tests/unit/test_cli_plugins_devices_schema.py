from __future__ import annotations

import json
import tomllib

import pytest
from fake_cell import fake_host

from lsds.cli import devices as devices_module
from lsds.cli import plugins as plugins_module
from lsds.cli.main import main
from lsds.config import RigConfig
from lsds.contracts import CONFIG_KINDS


@pytest.fixture(autouse=True)
def _fakes(monkeypatch):
    for module in (plugins_module, devices_module):
        monkeypatch.setattr(module, "PluginHost", fake_host)


def test_plugins_table(capsys):
    assert main(["plugins"]) == 0
    out = capsys.readouterr().out
    line = next(line for line in out.splitlines() if "real-gripper" in line)
    assert "Hand-E, 2024-05-01" in line
    assert "needs a_vendor_sdk_nobody_has" in out
    assert "a fake fingertip" in out


def test_plugins_of_one_kind_as_json(capsys):
    assert main(["plugins", "--kind", "arm", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [backend["name"] for backend in data["backends"]] == ["fake-arm"]
    assert data["backends"][0]["distribution"] == "fakes"
    assert data["failures"] == []


def test_plugins_lists_what_failed_and_what_is_blocked(monkeypatch, capsys):
    def host():
        made = fake_host()
        made.register(object(), distribution="odd", name="odd")
        made.block(["fakes"])
        return made

    monkeypatch.setattr(plugins_module, "PluginHost", host)
    assert main(["plugins"]) == 0
    out = capsys.readouterr().out
    assert "no backend is installed" in out
    assert "plugin fakes (fakes): blocked" in out


def test_devices(monkeypatch, capsys, tmp_path):
    cameras = tmp_path / "v4l"
    cameras.mkdir()
    (tmp_path / "video0").touch()
    (cameras / "usb-GelSight_Mini-index0").symlink_to(tmp_path / "video0")
    monkeypatch.setattr(devices_module, "CAMERAS", cameras)
    monkeypatch.setattr(devices_module, "SERIAL_PORTS", tmp_path / "nothing")
    assert main(["devices"]) == 0
    out = capsys.readouterr().out
    assert f"usb-GelSight_Mini-index0 -> {tmp_path / 'video0'}" in out
    assert "serial ports: none" in out
    assert "ready (simulated)" in out

    target = tmp_path / "devices.json"
    assert main(["devices", "--json", str(target)]) == 0
    data = json.loads(target.read_text())
    (camera,) = data["cameras"]
    assert camera["path"] == str(cameras / "usb-GelSight_Mini-index0")
    assert camera["device"] == str(tmp_path / "video0")
    assert camera["tactile"] is True
    assert {"kind": "gripper", "name": "no-sdk", "missing": ["a_vendor_sdk_nobody_has"], "simulated": True} in data[
        "backends"
    ]


def test_schema_to_a_file_and_example_to_stdout(capsys, tmp_path):
    target = tmp_path / "schema.json"
    assert main(["config", "schema", "-o", str(target)]) == 0
    assert json.loads(target.read_text())["$schema"].endswith("2020-12/schema")
    assert main(["config", "example"]) == 0
    example = RigConfig.model_validate(tomllib.loads(capsys.readouterr().out))
    # The example spells out options tables, which the default leaves to the backends; all else is the default.
    bare = {kind: {"backend": example.section(kind).backend} for kind in CONFIG_KINDS}
    assert example.model_copy(update={k: type(example.section(k))(**v) for k, v in bare.items()}) == RigConfig()


def test_a_file_that_cannot_be_written_is_one_clear_error(capsys, tmp_path):
    assert main(["config", "schema", "-o", str(tmp_path / "no" / "x.json")]) == 5
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "create the folder first" in err

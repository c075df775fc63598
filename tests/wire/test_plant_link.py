"""The plant in its own process, and what its clients may do to it."""

from __future__ import annotations

import importlib
import os
import re
import socket
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from lsds_mocks.cell.processes import ProcessCell, ProcessCellOptions
from lsds_mocks.link.packets import pack_gel, unpack_gel
from lsds_mocks.link.private_socket import make_private
from lsds_mocks.link.remote import RemoteArm, RemoteFingers, RemoteScene, RemoteTruth
from lsds_mocks.link.remote_gel import RemoteGel
from lsds_mocks.mock_process import MockProcess

from lsds.clock import WallClock
from lsds.contracts import BuildContext
from lsds.contracts.plant import attach
from lsds.errors import ConfigError, ConnectFailed, DeviceError
from lsds.registry import PluginHost
from tests.wire.waiting import until

CLOCK = WallClock()


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    path = str(tmp_path_factory.mktemp("plant") / "plant.sock")
    with MockProcess("plant", {"socket": path, "fidelity": "winkler"}) as process:
        yield path
        assert process.complaints == ""


def test_fingers_close_on_the_pipe_and_the_gel_is_pressed_and_all_is_put_back(address):
    fingers, gel, truth = RemoteFingers(address), RemoteGel(address), RemoteTruth(address)
    try:
        fingers.drive(0.0236, 0.15, 60.0)
        assert until(lambda: abs(fingers.fingers().aperture_m - 0.0236) < 1e-6)
        assert fingers.fingers().normal_n > 1
        state = gel.at(CLOCK.now())
        assert state.normal_force_n == pytest.approx(fingers.fingers().normal_n, rel=0.05)
        assert gel.gel.contact_fraction(state, 0.02, 0.015) > 0.1
        assert gel.at(CLOCK.now() - 10**9) is None
        assert truth.truth(CLOCK.now(), 1.0).normal_force_n > 1
        truth.reset()
        assert truth.truth(CLOCK.now(), 1.0).normal_force_n == 0
        assert until(lambda: fingers.fingers().aperture_m == 0.05)
    finally:
        for link in (fingers, gel, truth):
            link.close()


def test_the_wire_mock_of_the_guide_moves_the_fingers_of_the_plant(address, tmp_path, monkeypatch):
    page = Path(__file__).parents[2] / "docs" / "plugins" / "wire_mock.md"
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "acme_wire_mock.py").write_text("\n\n".join(blocks), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    host = PluginHost()
    host.register(importlib.import_module("acme_wire_mock"), distribution="acme", name="acme")
    mock = host.build("wire_mock", "acme-2f", {"cell": address}, BuildContext(CLOCK))
    served = mock.start()["tcp"].rpartition(":")
    stop = threading.Event()
    thread = threading.Thread(target=mock.serve, args=(stop,))
    thread.start()
    own = RemoteFingers(address)
    try:
        with socket.create_connection((served[0], int(served[2])), 2.0) as client:
            client.sendall(b"MOVE 23.6\n")
            assert client.recv(100) == b"OK\n"
            assert until(lambda: abs(own.fingers().aperture_m - 0.0236) < 1e-6)
            assert own.fingers().normal_n > 1
            client.sendall(b"STATE\n")
            assert client.recv(100) == b"23.60 23.60\n"
    finally:
        stop.set()
        thread.join(5.0)
        mock.close()
        own.close()


def test_what_cannot_be_attached_to_is_an_error_that_names_it(tmp_path):
    with pytest.raises(ConfigError, match="no installed plugin offers a cell on the wire"):
        attach(BuildContext(CLOCK), "nowhere.sock")
    context = BuildContext(CLOCK)
    PluginHost().build("tracker", "dis", {}, context)
    with pytest.raises(ConnectFailed, match=r"nowhere\.sock"):
        attach(context, str(tmp_path / "nowhere.sock")).finger_link()


def test_the_pipe_follows_the_arm_that_holds_it(address):
    fingers, arm, scene, truth = RemoteFingers(address), RemoteArm(address), RemoteScene(address), RemoteTruth(address)
    try:
        truth.reset()
        fingers.drive(0.0215, 0.15, 100.0)
        began = CLOCK.now()
        while (since := CLOCK.now() - began) < 1_500_000_000:
            rising = max(0.0, (since - 500_000_000) / 1e9)
            arm.follow(CLOCK.now(), 0.7 + 0.05 * rising, 0.05 if rising else 0.0)
            CLOCK.sleep_until(CLOCK.now() + 2_000_000)
        assert truth.truth(CLOCK.now(), 1.0).object_height_m == pytest.approx(0.05, abs=0.005)
        assert arm.load().pull_n == pytest.approx(0.3 * 9.81, rel=0.1)
        seen = scene.scene(CLOCK.now() - 20_000_000)
        assert seen.object_m == pytest.approx(0.05, abs=0.005)
        truth.reset()
    finally:
        for link in (fingers, arm, scene, truth):
            link.close()


def test_invalid_packets_disconnect_only_their_sender(address):
    truth = RemoteTruth(address)
    try:
        for rubbish in (b"\x02", b"\x01\x09", b"\x04" + b"x" * 40, b"\xff" * 9):
            with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
                link.connect(address)
                link.sendall(rubbish)
                time.sleep(0.02)
        assert truth.truth(CLOCK.now(), 0.5)
    finally:
        truth.close()


def test_one_plant_per_address_and_none_at_an_unused_one(address, tmp_path):
    with pytest.raises(ConnectFailed, match="another plant serves at"):
        MockProcess("plant", {"socket": address}).start()
    with pytest.raises(ConnectFailed, match=r"no plant at .*start it first"):
        RemoteTruth(str(tmp_path / "none.sock"))


def test_the_plant_knows_no_faults(address, tmp_path):
    with (
        MockProcess("plant", {"socket": str(tmp_path / "p.sock")}) as plant,
        pytest.raises(DeviceError, match="no faults"),
    ):
        plant.inject("drop")


def test_a_gel_survives_its_packet(address):
    gel = RemoteGel(address)
    try:
        state = gel.at(CLOCK.now())
        t_ns, again = unpack_gel(pack_gel(5, state))
        assert t_ns == 5
        assert (again.deflection_m == state.deflection_m).all()
        assert (again.slid == state.slid).all()
        assert again.reach_m == state.reach_m
    finally:
        gel.close()


# -- who may join ---------------------------------------------------------------------------------------------


def test_a_run_keeps_its_socket_in_a_folder_that_only_its_user_can_enter(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    cell = ProcessCell(ProcessCellOptions(mocks={}), BuildContext(CLOCK, 0))
    cell.connect()
    try:
        path = Path(cell.socket)
        assert path.parent.parent == tmp_path
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0
    finally:
        cell.close()


@pytest.mark.parametrize("trap", ["open", "link", "file"])
def test_a_folder_that_others_prepared_is_refused(tmp_path, trap):
    folder = tmp_path / "lsds"
    if trap == "open":
        folder.mkdir()
        folder.chmod(0o755)
    elif trap == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        folder.symlink_to(tmp_path / "elsewhere")
    else:
        folder.touch()
    with pytest.raises(ConnectFailed, match=str(folder)):
        make_private(folder)


def test_a_plant_of_another_user_is_not_joined(address, monkeypatch):
    monkeypatch.setattr(os, "getuid", lambda: 54321)
    with pytest.raises(ConnectFailed, match="belongs to another user"):
        RemoteTruth(address)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can act as another user")
def test_a_client_of_another_user_is_not_let_in(address):
    os.chmod(address, 0o666)
    try:
        script = (
            "import os, socket, sys; os.setuid(54321); link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET);"
            "link.connect(sys.argv[1]); link.settimeout(5); sys.exit(bool(link.recv(1)))"
        )
        for folder in (Path(address).parent, *Path(address).parent.parents):
            if folder.stat().st_mode & 0o001 == 0:
                folder.chmod(folder.stat().st_mode | 0o011)
        assert subprocess.run([sys.executable, "-c", script, address], timeout=10, check=False).returncode == 0
    finally:
        os.chmod(address, 0o600)

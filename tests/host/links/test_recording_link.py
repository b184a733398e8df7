from __future__ import annotations

import logging
from pathlib import Path

import pytest

from tickrig import Bench
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.record.replay import read_bench_recording
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.recording_link import RecordingLink
from tickrig.host.rrc.client import RrcClient
from tickrig.wire.can import CanFrame


def rrc_link() -> SimLink:
    line = SerialLine()
    rig = Rig(Station(Rrc(), line.a))
    rig.run_for(500_000)
    return SimLink(rig, line.b)


def lines(path: Path) -> list[str]:
    return path.read_text("ascii").splitlines()


def test_what_passes_a_serial_port_is_recorded(tmp_path: Path) -> None:
    path = tmp_path / "run.trace"
    link = RecordingLink(rrc_link(), path, name="rrc", type="rrc")
    assert link.receive(0) == b"EV:Initialized\n"
    RrcClient(link).version()
    link.note("power_button", 1)
    link.note_reset()
    link.receive(50_000)
    link.close()
    link.close()
    first, *others = lines(path)
    assert first == (
        '# tickrig-trace v2 {"seed": 0, "place": "port", "wires": {"wire": {"type": "serial"}},'
        ' "devices": {"rrc": {"wire": "wire", "type": "rrc"}}}'
    )
    assert others == [
        r"0.000000 rrc < EV:Initialized\n",
        r"0.000000 rrc > version\n",
        r"0.021997 rrc < OK:version\nVersion 1.0\n",
        "0.021997 rrc ! power_button=1",
        "0.021997 rrc ! reset",
        "0.071997 .",
    ]


def test_what_passes_a_bus_is_recorded_with_its_times(tmp_path: Path) -> None:
    wire = CanWire()
    slave = make_f_palette(3)
    rig = Rig(Station(slave, wire.end()))
    link = RecordingLink(CanHost(rig, wire.end()), tmp_path / "t", name="can0")
    assert link.receive_stamped(5_000)[1][0][1] == CanFrame.parse("703#00")
    link.send((CanFrame.parse("000#0100"), CanFrame.parse("603#4000100000000000")))
    link.receive(9_000)
    link.close()
    recording = read_bench_recording((tmp_path / "t").read_bytes())
    assert recording.at_port
    assert lines(tmp_path / "t")[1:] == [
        "0.001056 can0 < 703#00",
        "0.001056 can0 > 000#0100",
        "0.001056 can0 > 603#4000100000000000",
        "0.002057 can0 < 183#00",
        "0.002057 .",
    ]


def test_bytes_have_no_stamps(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="carries bytes"):
        RecordingLink(rrc_link(), tmp_path / "t").receive_stamped(0)


def test_a_line_that_is_gone_ends_nothing_but_the_line(tmp_path: Path) -> None:
    inner = rrc_link()
    link = RecordingLink(inner, tmp_path / "t")
    inner.close()
    for act in (lambda: link.send(b"x"), lambda: link.receive(0)):
        with pytest.raises(LinkClosed):
            act()
    link.close()
    assert lines(tmp_path / "t")[1:] == ["0.000000 ."]


def test_a_full_disk_ends_the_recording_and_not_the_link(
    caplog: pytest.LogCaptureFixture,
) -> None:
    link = RecordingLink(rrc_link(), Path("/dev/full"))
    link.send(b"devn\n")
    assert link.receive(50_000)
    assert link.recording_error == "/dev/full: No space left on device"
    assert [(r.levelno, r.getMessage()) for r in caplog.records] == [
        (
            logging.WARNING,
            "recording ended: /dev/full: No space left on device; the link goes on",
        )
    ]


def test_the_link_of_a_bench_is_recorded(tmp_path: Path) -> None:
    with Bench(Rrc()) as bench:
        bench.run_for("500ms")
        link = RecordingLink(bench.link, tmp_path / "t", type="rrc")
        RrcClient(link).version()
        link.close()
    assert r"< OK:version\nVersion 1.0\n" in (tmp_path / "t").read_text()

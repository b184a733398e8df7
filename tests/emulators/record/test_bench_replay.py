from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.body import BodyParameters, WheeledBody
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.canopen.models.motor_core_unit import make_motor_core_unit
from tickrig.device.canopen.slave import Nonvolatile
from tickrig.device.canopen.stack import make_slave
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.body import BodyOnDrives, DrivenWheel
from tickrig.emulators.canopen.eds import EdsCache, read_eds
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.record.recorder import TraceRecorder
from tickrig.emulators.record.replay import ReplayDifference, read_bench_recording, replay_device
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.recorded_device import make_recorded, node_entry
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, WireEntry, WireType
from tickrig.host.text.trace import TraceError
from tickrig.wire.can import CanFrame

EDS = Path(__file__).parents[2] / "golden" / "canopen" / "r1.eds"
HEARTBEAT = {0x1017 << 8: b"\x05\x00"}
SAVE = (b"\x23\x10\x10\x01save", b"\x23\x11\x10\x01load")
WIRES = {"line": WireEntry(WireType.SERIAL), "can": WireEntry(WireType.CAN)}


class Bench:
    """An RRC on a line; drives under a body, an I/O module and a node of an EDS on a bus."""

    def __init__(self) -> None:
        self.line, self.can, self.rrc = SerialLine(), CanWire(), Rrc()
        slaves = {
            "left": make_epos(1),
            "right": make_epos(2, Nonvolatile(dict(HEARTBEAT))),  # it may save
            "io": make_f_palette(3),
            "drive": make_motor_core_unit(4),
            "file": make_slave(read_eds(EDS).make_dictionary(), 5),
        }
        files = {"file": EDS}
        entries = {n: node_entry("can", s, files.get(n, "")) for n, s in slaves.items()}
        header = BenchHeader({"rrc": DeviceEntry("line", "rrc"), **entries}, WIRES)
        self.recorder = TraceRecorder(None, header)
        self.nodes = {name: Node(name, slave, self.can) for name, slave in slaves.items()}
        wheels = [
            DrivenWheel("left", self.nodes["left"]),
            DrivenWheel("right", self.nodes["right"], -1),
        ]
        parameters = BodyParameters(
            kind="differential", wheel_radius_m=0.1, tread_m=0.4, mass_kg=20.0, friction=0.02
        )
        body = BodyOnDrives(WheeledBody(parameters), wheels)
        device = self.recorder.device
        self.rig = Rig(
            Station(device("rrc", self.rrc), self.line.a),
            *(Station(device(name, node), node.port) for name, node in self.nodes.items()),
            couplings=[body],
        )
        self.host = self.can.end()
        self.host.auto_recovery = True

    def send(self, *texts: str) -> None:
        self.host.send(self.rig.now_us, tuple(map(CanFrame.parse, texts)))

    def set(self, node: str, name: str, value: float | str) -> None:
        signal = self.nodes[node].signal(name)
        assert signal
        signal.write(value)

    @property
    def trace(self) -> bytes:
        lines = self.recorder.lines(self.rig.now_us)
        return "".join(f"{line}\n" for line in lines).encode()


def differences(trace: bytes) -> dict[str, ReplayDifference[Any]]:
    recording, cache = read_bench_recording(trace), EdsCache()
    header = recording.header
    return {
        name: found
        for name in header.devices
        if (
            found := replay_device(
                recording, name, make_recorded(recording.header, name, EDS.parent, cache)
            )
        )
    }


def test_a_bench_at_work_replays_identically() -> None:
    bench = Bench()
    bench.rig.run_for(5_000)
    bench.send("000#0100")
    bench.rrc.inputs.set("power_button", 1)
    for node in (1, 2):
        bench.send(f"60{node}#2F60600003000000", f"60{node}#23FF600010270000")
        for word in ("06", "07", "0F"):
            bench.send(f"60{node}#2B406000{word}000000")
            bench.rig.run_for(5_000)
    bench.rig.run_for(200_000)
    bench.line.b.send(bench.rig.now_us, b"output1e00\n")
    bench.set("io", "0x6000:1", 5)
    bench.set("right", "power_off", 1)
    bench.can.faults.arm("corrupt", "0.3")
    bench.rig.run_for(100_000)
    bench.set("right", "power_off", 0)
    bench.can.faults.clear("corrupt")
    bench.send(f"604#{SAVE[0].hex().upper()}")
    bench.rig.run_for(300_000)
    text = bench.trace.decode()
    assert " left ! load_nm=" in text
    assert " right > " in text
    assert '"right": {"wire": "can", "type": "epos", "node_id": 2, "stored": {' in text
    assert differences(bench.trace) == {}


NAMES = st.sampled_from(["left", "right", "io", "drive", "file"])
ACTS = st.one_of(
    st.tuples(st.just("line"), st.sampled_from([b"output1e00\n", b"devn\n", b"\xff\x00", b"st"])),
    st.tuples(
        st.just("sdo"),
        st.integers(1, 5),
        st.sampled_from(
            [
                "40001000",
                "2B17100005",
                "2B17100000",
                "2F60600003",
                "23FF600010270000",
                "2B4060000F",
                "2B40600006",
                "2B40600007",
                SAVE[0].hex(),
                SAVE[1].hex(),
                "2F001801 01".replace(" ", ""),
                "2300180180010080",
                "2F00180201",
            ]
        ),
    ),
    st.tuples(
        st.just("frame"),
        st.sampled_from(
            [
                "000#0100",
                "000#0200",
                "000#8000",
                "000#8100",
                "000#8203",
                "080#",
                "201#0F00",
                "301#01",
                "100#0000000001000000",
                "7E5#0401000000000000",
                "703#R1",
            ]
        ),
    ),
    st.tuples(
        st.just("set"),
        NAMES,
        st.sampled_from(
            [
                ("power_off", 1),
                ("power_off", 0),
                ("unplugged", 1),
                ("unplugged", 0),
                ("emergency", 0x2310),
                ("emergency", 0),
                ("0x1017", 7),
                ("0x1017", 7),
            ]
        ),
    ),
    st.tuples(st.just("fault"), st.sampled_from(["corrupt", "drop"]), st.booleans()),
    st.tuples(st.just("reset"), NAMES),
)


@settings(deadline=None, max_examples=20)
@given(st.lists(st.tuples(st.integers(0, 30_000), ACTS), max_size=25))
def test_any_run_of_a_bench_replays_identically(acts: list[tuple[int, tuple[object, ...]]]) -> None:
    bench = Bench()
    for wait_us, act in acts:
        bench.rig.run_for(wait_us)
        match act:
            case ("line", bytes(data)):
                bench.line.b.send(bench.rig.now_us, data)
            case ("sdo", int(node), str(data)):
                bench.send(f"60{node}#{data:0<16}")
            case ("frame", str(text)):
                bench.send(text)
            case ("set", str(name), (str(signal), int(value))):
                bench.set(name, signal, value)
            case ("fault", str(name), bool(on)):
                faults = bench.can.faults
                faults.arm(name, "0.3") if on else faults.clear(name)
            case ("reset", str(name)):
                index = list(bench.nodes).index(name) + 1
                bench.rig.stations[index].device.reset()
    bench.rig.run_for(50_000)
    assert differences(bench.trace) == {}


@pytest.fixture(scope="module")
def trace() -> bytes:
    bench = Bench()
    bench.rig.run_for(20_000)
    bench.set("io", "0x6000:1", 5)
    bench.send("603#4000600100000000")
    bench.rig.run_for(20_000)
    return bench.trace


@pytest.mark.parametrize(
    ("old", "new", "at_us", "who"),
    [
        ("0.021000 io < 583#4F00600105000000", "0.021000 io < 583#4F00600106000000", 21_000, "io"),
        ("0x6000:1=5", "0x6000:1=6", 21_000, "io"),
        ("0.001000 drive < 704#00\n", "", 1_000, "drive"),
    ],
)
def test_the_first_difference_of_a_device_is_found(
    trace: bytes, old: str, new: str, at_us: int, who: str
) -> None:
    changed = trace.replace(old.encode(), new.encode())
    assert changed != trace
    found = differences(changed)
    assert list(found) == [who]
    assert found[who].at_us == at_us


def test_a_killed_writer_costs_the_last_tick_only(trace: bytes) -> None:
    first = trace.index(b"\n") + 1
    for size in range(first, len(trace), 7):
        recording = read_bench_recording(trace[:size])
        assert not recording.ended
        assert differences(trace[:size]) == {}


def made(entry: DeviceEntry, folder: Path) -> object:
    """Make a device of a trace that is beside it in a folder."""
    return make_recorded(BenchHeader({"a": entry}, WIRES), "a", folder, EdsCache())


def test_what_cannot_be_made_again_is_said_in_a_line(trace: bytes, tmp_path: Path) -> None:
    header = read_bench_recording(trace).header
    entry = header.devices["file"]
    with pytest.raises(ValueError, match=r"device a: its file .*nope.eds is not here, nor beside"):
        made(replace(entry, type="nope.eds"), tmp_path)
    (tmp_path / "nope.eds").write_text("other")
    with pytest.raises(ValueError, match="is another file than the one that was recorded"):
        made(replace(entry, type="nope.eds"), tmp_path)
    with pytest.raises(ValueError, match="was made by a program, not of a type"):
        made(replace(entry, type=""), tmp_path)
    with pytest.raises(ValueError, match="recorded on 'toaster'"):
        made(DeviceEntry("line", "toaster"), tmp_path)
    with pytest.raises(ValueError, match="device a: rrc cannot be on wire can"):
        made(replace(entry, type="rrc", node_id=None), tmp_path)
    (tmp_path / EDS.name).write_bytes(EDS.read_bytes())
    moved = replace(entry, type=f"/elsewhere/{EDS.name}")
    assert isinstance(made(moved, tmp_path), Node)
    right = header.devices["right"]
    for stored in ({}, {"parameters": {"1017:00": "05"}, "node_id": None, "bit_rate_index": None}):
        with pytest.raises(ValueError, match=r"device a: (what it had stored is|it has no room)"):
            made(replace(right, stored=stored or {"a": 1}), tmp_path)


def test_an_input_that_a_device_does_not_have_is_refused(trace: bytes) -> None:
    changed = trace.replace(b"io ! 0x6000:1=5", b"io ! 0x2FFF:1=5")
    with pytest.raises(TraceError, match=r"line [0-9]+: io: no input '0x2FFF:1'"):
        differences(changed)

from __future__ import annotations

import copy
import logging
import pickle
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from tests.emulators.lamp import Lamp
from tickrig.device.canopen.models.epos import NODE_ID, make_epos
from tickrig.device.twin import twin
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.record.recorder import TICKS_KEPT, Tick, TraceRecorder, _Ticks
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, WireEntry, WireType
from tickrig.wire.can import CanFrame

WIRES = {"line": WireEntry(WireType.SERIAL), "bus": WireEntry(WireType.CAN, {"bit_rate": 10**6})}
DEVICES = {"lamp": DeviceEntry("line"), "drive": DeviceEntry("bus", "epos", node_id=NODE_ID)}
HEADER = BenchHeader(DEVICES, WIRES, seed=3)


@dataclass
class Bench:
    """A lamp on a line and a drive on a bus, recorded."""

    path: Path | None = None
    line: SerialLine = field(default_factory=SerialLine)
    bus: CanWire = field(default_factory=CanWire)

    def __post_init__(self) -> None:
        self.recorder = TraceRecorder(self.path, HEADER)
        self.lamp, self.node = Lamp(), Node("drive", make_epos(), self.bus)
        self.host: CanEnd = self.bus.end()
        self.rig = Rig(
            Station(self.recorder.device("lamp", self.lamp), self.line.a),
            Station(self.recorder.device("drive", self.node), self.node.port),
        )

    def set(self, name: str, value: float | str) -> None:
        signal = self.node.signal(name)
        assert signal
        signal.write(value)

    def run(self, to_us: int) -> None:
        self.rig.run_to(to_us)

    def lines(self) -> list[str]:
        return [*self.recorder.lines(self.rig.now_us)][1:]


def test_the_devices_of_a_bench_are_recorded_with_what_is_done_to_them() -> None:
    bench = Bench()
    bench.run(2_500)
    bench.line.b.send(bench.rig.now_us, b"ab\xff")
    bench.host.send(bench.rig.now_us, (CanFrame.parse("601#4000100000000000"),))
    bench.lamp.inputs.set("x_mm", 5)
    bench.set("0x1017", 2)
    bench.set("load_nm", 0.25)
    bench.recorder.wire_fault(bench.rig.now_us, "bus", "drop=0.1")
    bench.run(6_000)
    assert bench.lines() == [
        r"0.001000 lamp < hi\n",
        "0.001000 drive < 701#00",
        "0.002500 bus ~ drop=0.1",
        "0.003000 lamp ! x_mm=5",
        r"0.003000 lamp > ab\xff",
        r"0.003000 lamp < ab\xff",
        "0.003000 drive ! 0x1017=2",
        "0.003000 drive ! load_nm=0.25",
        "0.003000 drive > 601#4000100000000000",
        "0.003000 drive < 581#4300100092010200",
        "0.005000 drive < 701#7F",
        "0.006000 .",
    ]


def test_what_a_can_controller_tells_its_node_is_recorded() -> None:
    bench = Bench()
    bench.run(1_500)
    bench.set("unplugged", 1)
    bench.node.slave.send(0x123, b"")
    bench.run(30_000)
    bench.set("power_off", 1)
    bench.set("power_off", 0)
    bench.run(31_000)
    done = [line.partition(" drive ! ")[2] for line in bench.lines() if "drive !" in line]
    assert done == ["unplugged=1", "bus_state error-passive", "power_off=1", "power_off=0"]


def test_a_bench_is_the_same_recorded_or_not() -> None:
    bench = Bench()
    plain = Rig(Station(other := Node("drive", make_epos(), wire := CanWire()), wire.end()))
    assert other.accepts == bench.node.accepts
    plain.run_to(100_000)
    bench.run(100_000)
    assert bench.node.slave.state is other.slave.state


def test_a_copy_of_a_bench_has_what_was_recorded_and_goes_on_by_itself() -> None:
    bench = Bench()
    bench.run(1_500)
    fork = copy.copy(bench)
    fork.rig, fork.recorder, fork.node, fork.line = bench.rig.fork(
        bench.recorder, bench.node, bench.line
    )
    before = bench.lines()
    fork.set("0x1017", 2)
    fork.line.b.send(fork.rig.now_us, b"x")
    fork.run(3_500)
    assert bench.lines() == before
    assert fork.lines()[:-1] == [
        *before[:-1],
        r"0.002000 lamp > x",
        r"0.002000 lamp < x",
        "0.002000 drive ! 0x1017=2",
    ]
    bench.run(3_500)
    assert bench.lines()[:-1] == before[:-1]


def test_nobody_records_a_copy_of_what_goes_into_a_file(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run.trace")
    bench.run(1_500)
    rig, recorder = bench.rig.fork(bench.recorder)
    rig.run_to(9_000)
    assert isinstance(rig.stations[0].device, Lamp)
    twin(recorder).close(9_000)
    bench.recorder.close(2_000)
    text = (tmp_path / "run.trace").read_text()
    assert text.splitlines()[1:] == [
        r"0.001000 lamp < hi\n",
        "0.001000 drive < 701#00",
        "0.002000 .",
    ]
    with pytest.raises(ValueError, match="in a file already"):
        bench.recorder.save(tmp_path / "other", 0)


def test_what_is_kept_in_memory_is_saved_as_a_file_would_have_it(tmp_path: Path) -> None:
    kept, written = Bench(), Bench(tmp_path / "written")
    for bench in (kept, written):
        bench.run(5_000)
    kept.recorder.save(tmp_path / "kept", 5_000)
    written.recorder.close(5_000)
    assert (tmp_path / "kept").read_bytes() == (tmp_path / "written").read_bytes()


def test_a_run_is_never_shorter_than_what_is_in_it(tmp_path: Path) -> None:
    kept, written = Bench(), Bench(tmp_path / "written")
    for bench in (kept, written):
        bench.recorder.wire_fault(5_000, "line", "cut")
    written.recorder.close(4_999)
    lines = (tmp_path / "written").read_text("ascii").splitlines()
    assert lines == [*kept.recorder.lines(4_999)]
    assert lines[-1] == "0.005000 ."


def test_a_full_disk_ends_the_recording_with_one_warning(caplog: pytest.LogCaptureFixture) -> None:
    bench = Bench(Path("/dev/full"))
    bench.run(50_000)
    bench.recorder.close(50_000)
    assert bench.recorder.error == "/dev/full: No space left on device"
    assert [record.levelno for record in caplog.records] == [logging.WARNING]


def test_a_device_or_name_that_the_header_cannot_have_is_refused() -> None:
    with pytest.raises(KeyError):
        TraceRecorder(None, HEADER).device("nope", Lamp())
    with pytest.raises(ValueError, match="'a b' cannot stand in a trace"):
        BenchHeader({"a b": DeviceEntry("line")}, WIRES)
    with pytest.raises(ValueError, match="is on wire 'air', which is not there"):
        BenchHeader({"a": DeviceEntry("air")}, WIRES)


def long_run(recorder: TraceRecorder, ticks: int, first: int = 0) -> None:
    for number in range(first, first + ticks):
        recorder.add(Tick(number * 1_000, "lamp", (), b"", b"%d\x85\n" % number))


def test_a_long_run_keeps_few_ticks_in_memory_and_loses_none(tmp_path: Path) -> None:
    recorder, in_file = TraceRecorder(None, HEADER), TraceRecorder(tmp_path / "a.trace", HEADER)
    for each in (recorder, in_file):
        long_run(each, 2 * TICKS_KEPT)
    kept = copy.deepcopy(recorder)
    for each in (recorder, in_file):
        long_run(each, TICKS_KEPT // 2, 2 * TICKS_KEPT)
    in_file.close(0)
    recorder.save(tmp_path / "b.trace", 0)
    assert (tmp_path / "b.trace").read_bytes() == (tmp_path / "a.trace").read_bytes()
    here = [*recorder.lines(0)]
    assert [*kept.lines(0)][:-1] == here[: 2 * TICKS_KEPT + 1]
    assert [*pickle.loads(pickle.dumps(recorder)).lines(0)] == here


def test_many_copies_of_a_long_run_keep_few_ticks_too() -> None:
    recorder = TraceRecorder(None, HEADER)
    for number in range(20):
        long_run(recorder, TICKS_KEPT // 4, number * TICKS_KEPT // 4)
        copy.deepcopy(recorder)
    in_memory = sum(len(part.ticks) for part in recorder._shared if isinstance(part, _Ticks))
    assert in_memory + len(recorder._ticks) < TICKS_KEPT
    assert len([*recorder.lines(0)]) == 2 + 5 * TICKS_KEPT


def test_a_long_run_stays_in_memory_where_no_file_can_be_written(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refused() -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.TemporaryFile", refused)
    recorder = TraceRecorder(None, HEADER)
    long_run(recorder, 3 * TICKS_KEPT)
    assert len([*recorder.lines(0)]) == 2 + 3 * TICKS_KEPT
    assert [record.message for record in caplog.records] == [
        "a trace stays in memory: no temporary file: No space left on device"
    ]

"""The host of a ucode reader, with the emulated one on a line that spoils what passes."""

from __future__ import annotations

from tests.host.rtc.ucode.bench import DOOR
from tickrig.device.ucode_reader import Marker, UcodeReader
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rtc.ucode.infrared_rays_reader import Round, UcodeReaderClient


class ReaderBench:
    """The client polls every 10 ms."""

    def __init__(self, *markers: Marker) -> None:
        self.reader, self.line = UcodeReader(markers=markers), SerialLine(38_400)
        self.port = FaultyPort(self.line.a, BYTE_FAULTS, seed=1)
        self.rig = Rig(Station(self.reader, self.port))
        self.client = UcodeReaderClient(SimLink(self.rig, self.line.b))

    def run(self, duration_ms: int) -> list[Round]:
        rounds = []
        for _ in range(duration_ms // 10):
            self.rig.run_for(10_000)
            rounds += self.client.poll()
        return rounds


def test_rounds_come_whole() -> None:
    bench = ReaderBench(Marker(DOOR, 1, 0))
    assert bench.run(350) == [Round(0, ((DOOR, 67),))]
    bench.reader.inputs.set("x_m", 100)
    assert bench.run(100) == [Round(1)]
    bench.reader.inputs.set("sunlight", 1)
    assert bench.run(100) == [Round(2, blinded=True)]


def test_a_round_with_a_garbled_line_is_left_out() -> None:
    bench = ReaderBench(Marker(DOOR, 1, 0), Marker("0" * 32, 2, 0))
    bench.port.arm("flip", "0.0003")
    rounds = bench.run(20_000)
    assert all(set(found.ucodes) == {(DOOR, 67), ("0" * 32, 33)} for found in rounds)
    assert bench.client.garbled
    assert bench.client.incomplete
    assert 100 < len(rounds) < 200


def test_one_that_listens_no_more_is_told_to() -> None:
    bench = ReaderBench(Marker(DOOR, 1, 0))
    bench.run(500)
    other = SimLink(bench.rig, bench.line.b)
    other.send(b"OFF\n")
    assert len(bench.run(1_000)) >= 8
    assert bench.client.restarts == 0


def test_a_silent_one_is_called_each_second() -> None:
    bench = ReaderBench()
    bench.run(500)
    bench.reader.inputs.set("power_cut", 1)
    bench.run(5_000)
    assert bench.client.restarts == 4
    bench.reader.inputs.set("power_cut", 0)
    assert len(bench.run(1_000)) >= 7


def test_at_the_end_it_listens_no_more() -> None:
    bench = ReaderBench()
    bench.run(500)
    bench.client.close()
    bench.rig.run_for(100_000)
    assert bench.reader.read("listening") == 0


def test_what_waited_on_the_line_is_dropped() -> None:
    bench = ReaderBench(Marker(DOOR, 1, 0))
    bench.run(300)
    bench.rig.run_for(5_000_000)
    bench.client = UcodeReaderClient(SimLink(bench.rig, bench.line.b))
    assert len(bench.run(500)) == 5

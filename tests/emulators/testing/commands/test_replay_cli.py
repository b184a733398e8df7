from __future__ import annotations

import re
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner, Result

from tests.emulators.record.test_bench_replay import EDS, Bench
from tests.mutators import spoilt
from tickrig.emulators.commands.cli import main
from tickrig.emulators.record.recorder import TracedDevice, TraceFile
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rrc.device_type import RRC
from tickrig.emulators.rtc_lite.device_type import RTC_LITE
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.bench import Bench as OpenBench
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, WireEntry, WireType
from tickrig.host.text.trace import Header
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import LiteFrame


@pytest.fixture(scope="module")
def bench_trace() -> bytes:
    bench = Bench()
    bench.rig.run_for(5_000)
    bench.send("000#0100", "603#4000600100000000")
    bench.set("io", "0x6000:1", 5)
    bench.recorder.wire_fault(bench.rig.now_us, "can", "drop=0.5")
    bench.line.b.send(bench.rig.now_us, b"devn\n")
    bench.rig.run_for(25_000)
    return bench.trace


def replayed(path: Path, data: bytes) -> Result:
    path.write_bytes(data)
    return CliRunner().invoke(main, ["replay", str(path)])


def test_one_tick_is_one(tmp_path: Path) -> None:
    with OpenBench("rrc") as bench:
        bench.run_for("10ms")
        bench.save_trace(tmp_path / "run.trace")
    result = CliRunner().invoke(main, ["replay", str(tmp_path / "run.trace")])
    assert (result.exit_code, result.stdout) == (0, "identical: 1 tick\n")


def test_a_bench_is_replayed(tmp_path: Path, bench_trace: bytes) -> None:
    result = replayed(tmp_path / "run.trace", bench_trace)
    assert (result.exit_code, result.stdout) == (0, "identical: 17 ticks\n")


def test_the_first_difference_of_all_devices_is_said(tmp_path: Path, bench_trace: bytes) -> None:
    data = bench_trace.replace(b"703#00", b"703#01").replace(b"705#00", b"705#01")
    result = replayed(tmp_path / "run.trace", data)
    assert (result.exit_code, result.stdout) == (
        1,
        f"different at 0.001000 io ({tmp_path}/run.trace:6)\n"
        "  recorded < 703#01\n  replayed < 703#00\n",
    )


def test_verbose_tells_of_each_device(tmp_path: Path, bench_trace: bytes) -> None:
    path = tmp_path / "run.trace"
    path.write_bytes(bench_trace)
    result = CliRunner().invoke(main, ["replay", "-v", str(path)])
    assert result.exit_code == 0
    *each, last = result.stdout.splitlines()
    assert {line.partition(":")[0] for line in each} >= {"rrc", "io", "file"}
    assert all(re.fullmatch(r"\w+: \d+ ticks, identical", line) for line in each)
    assert last == "identical: 17 ticks"
    path.write_bytes(bench_trace.replace(b"703#00", b"703#01"))
    result = CliRunner().invoke(main, ["replay", str(path), "--verbose"])
    assert result.exit_code == 1
    assert re.search(
        r"^io: \d+ ticks, different at 0.001000 \(.*:6\)$", result.stdout, re.MULTILINE
    )
    assert result.stdout.count("identical") == len(each) - 1


def test_a_killed_recording_is_replayed_up_to_its_last_tick(
    tmp_path: Path, bench_trace: bytes
) -> None:
    result = replayed(tmp_path / "run.trace", bench_trace[:-20])
    assert result.exit_code == 0
    assert "no end line (killed?); its last tick is left out" in result.stderr


def test_devices_of_no_type_are_left_out(tmp_path: Path, bench_trace: bytes) -> None:
    other = bench_trace.replace(b'"type": "f-palette", ', b"")
    result = replayed(tmp_path / "run.trace", other)
    assert result.exit_code == 0
    assert "io was made by a program, not of a type: left out" in result.stderr


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (
            BenchHeader({"a": DeviceEntry("w")}, {"w": WireEntry(WireType.SERIAL)}).encode(),
            "its devices were made by a program, not of types: it cannot be replayed",
        ),
        (
            '# tickrig-trace v2 {"place": "port", "wires": {}, "devices": {}}',
            "it was recorded at a host's port, without ticks: use tickrig compare",
        ),
        ("# tickrig-trace v3 {}", "trace version 3; versions 1 and 2 are known"),
        ("# tickrig-trace v2 {", "line 1: Expecting property name"),
        ('# tickrig-trace v2 {"wires": {}}', "line 1: the header has no devices"),
        ("# tickrig-trace v2 " + "[" * 100_000, "line 1: "),
    ],
)
def test_what_cannot_be_replayed_is_said_in_a_line(
    tmp_path: Path, header: str, message: str
) -> None:
    result = replayed(tmp_path / "run.trace", f"{header}\n".encode())
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_an_eds_that_has_changed_is_said_in_a_line(tmp_path: Path, bench_trace: bytes) -> None:
    data = bench_trace.replace(str(EDS).encode(), b"r1.eds")
    (tmp_path / "r1.eds").write_text("[FileInfo]\n")
    result = replayed(tmp_path / "run.trace", data)
    assert (result.exit_code, result.stderr) == (
        2,
        f"Error: trace {tmp_path}/run.trace: device file: {tmp_path}/r1.eds is another file than"
        " the one that was recorded\n",
    )


@pytest.mark.parametrize("version", [1, 2])
def test_no_damage_of_a_trace_ends_in_a_traceback(
    tmp_path: Path, bench_trace: bytes, version: int
) -> None:
    data = bench_trace if version == 2 else rrc_trace(tmp_path / "v1")
    chance = Random(version)
    for _ in range(150):
        damaged = spoilt(data, chance)
        if re.search(rb"^\d{3,}\.", damaged, re.MULTILINE):
            continue  # a run of many minutes
        result = replayed(tmp_path / "run.trace", damaged)
        assert result.exit_code in (0, 1, 2)
        assert len(result.stderr.splitlines()) <= 2


def rrc_trace(path: Path) -> bytes:
    trace, line = TraceFile(path, Header("rrc", {})), SerialLine()
    rig = Rig(Station(device := TracedDevice(RRC.build({}), trace), line.a))
    device.inputs.set("power_button", 1)
    rig.run_for(1_000_000)
    line.b.send(rig.now_us, b"output1e00\n")
    rig.run_for(200_000)
    trace.close(rig.now_us)
    return path.read_bytes()


COMPONENT = """
from tickrig.device.rtc_lite.component import LiteComponent


class Mine(LiteComponent):
    type_name = "Mine"

    def on_activated(self):
        {body}
"""


@pytest.mark.parametrize("verb", ["replay", "compare"])
def test_what_a_file_of_a_user_raises_is_said_in_a_line(tmp_path: Path, verb: str) -> None:
    file = tmp_path / "mine.py"
    config = {"node": f"{file}:Mine"}
    trace, path = TraceFile(tmp_path / "t", Header("rtc-lite", config)), tmp_path / "t"
    line = SerialLine()
    file.write_text(COMPONENT.format(body="pass"))
    rig = Rig(Station(TracedDevice(RTC_LITE.build(config), trace), line.a))
    for command in (LiteCommand.INITIALIZE, LiteCommand.STARTUP, LiteCommand.ACTIVATE):
        line.b.send(rig.now_us, LiteFrame(command).encode())
        rig.run_for(100_000)
    trace.close(rig.now_us)
    file.write_text(COMPONENT.format(body="raise KeyError('oh')"))
    result = CliRunner().invoke(main, [verb, str(path), "--run-code"])
    assert result.exit_code == 2
    assert result.stderr == f"Error: {file}:Mine: line 9: KeyError: 'oh'\n"

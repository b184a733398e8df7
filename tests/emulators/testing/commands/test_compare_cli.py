from __future__ import annotations

import re
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner, Result

from tests.emulators.record.test_bench_replay import Bench
from tests.mutators import spoilt
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.settings import RrcConfig
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.commands.cli import main
from tickrig.emulators.commands.device_type import configure
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rrc.cli import main as rrc_emu
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.recording_link import RecordingLink
from tickrig.host.text.byte_text import escape, unescape
from tickrig.wire.can import CanFrame
from tickrig.wire.modbus import encode_frame
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import LiteFrame


def compared(path: Path, *words: str) -> Result:
    return CliRunner().invoke(main, ["compare", str(path), *words])


def record_rrc(path: Path, config: RrcConfig | None = None, on_us: int = 503_700) -> None:
    """Record an RRC that has been on for a while, its host, and a hand at its button."""
    line, rrc = SerialLine(), Rrc(config or RrcConfig())
    rig = Rig(Station(rrc, line.a))
    rig.run_for(on_us)
    link = RecordingLink(SimLink(rig, line.b), path, name="rrc", type="rrc")

    def wait(duration_us: int) -> None:
        until_us = link.now_us + duration_us
        while link.now_us < until_us:
            link.receive(until_us - link.now_us)

    wait(40_000)
    link.send(b"version\n")
    wait(100_300)
    rrc.inputs.set("power_button", 1)
    link.note("power_button", 1)
    wait(150_000)
    rrc.inputs.set("power_button", 0)
    link.note("power_button", 0)
    wait(1_000_000)
    link.send(b"watchdog32\n")  # 500 ms
    for _ in range(5):
        link.send(b"output1e00\n")
        wait(50_000)
    wait(1_500_000)  # the watchdog stops it
    link.close()


@pytest.mark.parametrize("on_us", [0, 5_000, 503_700, 1_000_000])
def test_a_recording_of_the_same_device_is_the_same(tmp_path: Path, on_us: int) -> None:
    record_rrc(tmp_path / "t", on_us=on_us)
    result = compared(tmp_path / "t")
    assert result.exit_code == 0, result.output
    assert "\nsame: " in result.stdout
    assert "rrc EV " in result.stdout


COMMANDS = (
    *(b"version\n", b"device\n", b"output1e00\n", b"watchdog0a\n", b"watchdog32\n", b"beep0101\n"),
    *(b"poweroff\n", b"junk\n", b"lim", b"\xff\xfe\n"),
)


@pytest.mark.parametrize("seed", range(12))
def test_a_recording_of_any_session_is_the_same(tmp_path: Path, seed: int) -> None:
    chance = Random(seed)
    line, rrc = SerialLine(), Rrc()
    rig = Rig(Station(rrc, line.a))
    rig.run_for(chance.choice([0, 1, 300_000, chance.randrange(3_000_000)]))
    link = RecordingLink(SimLink(rig, line.b), tmp_path / "t", type="rrc")
    for wait_us in (*(chance.randrange(20_000, 900_000) for _ in range(20)), 1_000_000):
        if chance.random() < 0.25:
            value = chance.choice([0, 1])
            rrc.inputs.set("power_button", value)
            link.note("power_button", value)
        else:
            link.send(chance.choice(COMMANDS))
        until_us = link.now_us + wait_us
        while link.now_us < until_us:
            link.receive(until_us - link.now_us)
    link.close()
    result = compared(tmp_path / "t")
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize("phase_us", range(0, 10_000, 1_250))
@pytest.mark.parametrize("held_us", [2_000, 6_000, 9_900])
def test_a_press_shorter_than_a_tick_is_the_same_in_any_phase(
    tmp_path: Path, phase_us: int, held_us: int
) -> None:
    """A port does not show where ticks begin; whether a short press is seen depends on that."""
    line, rrc = SerialLine(), Rrc()
    rig = Rig(Station(rrc, line.a))
    rig.run_for(503_000 + phase_us)
    line.b.poll(rig.now_us)
    link = RecordingLink(SimLink(rig, line.b), tmp_path / "t", name="rrc", type="rrc")
    for value, wait_us in ((1, held_us), (0, 1_000_000)):
        rrc.inputs.set("power_button", value)
        link.note("power_button", value)
        until_us = link.now_us + wait_us
        while link.now_us < until_us:
            link.receive(until_us - link.now_us)
    link.send(b"device\n")
    link.receive(100_000)
    link.close()
    result = compared(tmp_path / "t")
    assert result.exit_code == 0, result.output


def test_another_duration_is_found_with_its_line(tmp_path: Path) -> None:
    record_rrc(tmp_path / "t", RrcConfig(power_on_ticks=80))
    result = compared(tmp_path / "t")
    assert result.exit_code == 1
    first, recorded, emulated = result.stdout.splitlines()[:3]
    trace = (tmp_path / "t").read_text().splitlines()
    number = next(n for n, line in enumerate(trace, 1) if "PowerOnSuccess" in line)
    assert re.fullmatch(
        rf"different at [\d.]+ rrc \({re.escape(str(tmp_path))}/t:{number}\):"
        r" the emulator is (49|50)\d\.\d ms earlier",
        first,
    )
    assert recorded.startswith("  recorded < EV:PowerOnSuccess  at 0.9")
    assert emulated.startswith("  emulated < EV:PowerOnSuccess  at 0.4")
    assert compared(tmp_path / "t", "--tolerance", "600ms").exit_code == 0


def test_one_byte_is_found_with_its_line(tmp_path: Path) -> None:
    record_rrc(tmp_path / "t", RrcConfig(version="Version 1.1"))
    result = compared(tmp_path / "t")
    assert result.exit_code == 1
    trace = (tmp_path / "t").read_text().splitlines()
    number = next(n for n, line in enumerate(trace, 1) if "Version" in line)
    first, recorded, emulated = result.stdout.splitlines()[:3]
    assert f"({tmp_path}/t:{number}): the emulator answers differently" in first
    assert recorded.startswith("  recorded < Version 1.1  at 0.0")
    assert emulated.startswith("  emulated < Version 1.0  at 0.0")
    assert "\ndifferent: 1 of " in result.stdout
    for words in (["--ignore", "Version*"], ["--number", "Version*=0.1"]):
        assert compared(tmp_path / "t", *words).exit_code == 0


def test_another_watchdog_time_is_found(tmp_path: Path) -> None:
    record_rrc(tmp_path / "t")
    text = (tmp_path / "t").read_text()
    (tmp_path / "t").write_text(text.replace("> watchdog32", "> watchdog64"))
    result = compared(tmp_path / "t")
    assert result.exit_code == 1
    assert "ms later\n  recorded < EV:PowerOffWaitByWatchdog  at 1.99" in result.stdout


def test_all_that_was_said_can_be_listed(tmp_path: Path) -> None:
    record_rrc(tmp_path / "t")
    listed = compared(tmp_path / "t", "-v").stdout
    assert re.search(r"^  0\.0\d{5}      [-+]\d\.\d ms  rrc OK:version$", listed, re.MULTILINE)


def test_the_trace_of_an_emulator_is_compared_tick_by_tick(tmp_path: Path) -> None:
    scenario, trace = tmp_path / "s.txt", tmp_path / "run.trace"
    scenario.write_text("0 press power_button for 100ms\n1s send version\n1500ms send output1e00\n")
    words = ["--scenario", str(scenario), "--trace", str(trace)]
    assert CliRunner().invoke(rrc_emu, words).exit_code == 0
    assert compared(trace, "--tolerance", "0s").exit_code == 0
    trace.write_text(trace.read_text().replace('"power_on_ticks": 30', '"power_on_ticks": 31'))
    assert compared(trace).exit_code == 0
    assert "10.0 ms later" in compared(trace, "--tolerance", "5ms").stdout


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (
            ["--config", "power_on_event=PowerOn"],
            "--config does nothing here: the devices are made",
        ),
        (["--node", "5=epos"], "--node does nothing here: the devices are made as the trace"),
        (["--settle", "2s"], "--settle does nothing here: the devices are made as the trace"),
        (["--type", "rrc", "--node", "5=epos"], "--node does nothing here"),
    ],
)
def test_options_that_a_trace_of_ticks_does_not_use_are_refused(
    tmp_path: Path, words: list[str], why: str
) -> None:
    trace = tmp_path / "run.trace"
    scenario = ["--scenario", "-", "--trace", str(trace)]
    made = CliRunner().invoke(rrc_emu, scenario, input="0 press power_button for 100ms\n1s end\n")
    assert made.exit_code == 0
    result = compared(trace, *words)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert why in result.stderr
    assert compared(trace, "--type", "rrc", "--config", "power_on_event=PowerOn").exit_code == 1


def test_a_bench_is_compared_device_by_device(tmp_path: Path) -> None:
    bench = Bench()
    bench.rig.run_for(5_000)
    bench.send("000#0100", "603#4000600100000000")
    bench.line.b.send(bench.rig.now_us, b"version\n")
    bench.rig.run_for(50_000)
    path = tmp_path / "t"
    path.write_bytes(bench.trace)
    assert compared(path, "--tolerance", "0s").exit_code == 0
    path.write_bytes(bench.trace.replace(b"io < 583#", b"io < 584#"))
    result = compared(path, "--tolerance", "1ms")
    assert (result.exit_code, "io 583 " in result.stdout) == (1, True)


CHUNKS = {
    "rtc-lite": [*(LiteFrame(LiteCommand(x)).encode() for x in (b"CX", b"CI", b"AA")), b"junk"],
    "rh3-base": [
        encode_frame(1, bytes.fromhex("0300000002")),
        encode_frame(1, bytes.fromhex("0600640005")),
        b"noise",
        encode_frame(1, bytes.fromhex("0300000004")),
    ],
    "urg": [b"SCIP2.0\n", b"VV\n", b"PP\n", b"BM\n", b"MD0044072501002\n", b"QT\n"],
}


@pytest.mark.parametrize("name", CHUNKS)
def test_each_type_of_device_is_compared(tmp_path: Path, name: str) -> None:
    made = configure(name, {})
    emulator = Emulator(name, made.device, line=made.type.line)
    emulator.rig.run_for(700_100)
    link = RecordingLink(SimLink(emulator.rig, emulator.line.b), tmp_path / "t", type=name)
    for chunk in CHUNKS[name]:
        link.send(chunk)
        until_us = link.now_us + 300_000
        while link.now_us < until_us:
            link.receive(until_us - link.now_us)
    link.close()
    words = ["--ignore", "00???"] if name == "urg" else []  # its time stamps
    result = compared(tmp_path / "t", *words)
    assert result.exit_code == 0, result.output
    first, *lines = (tmp_path / "t").read_text().splitlines()
    place = max(n for n, line in enumerate(lines) if " < " in line)
    head, mark, text = lines[place].partition(" < ")
    data = bytearray(unescape(text))
    data[len(data) // 2] ^= 1
    lines[place] = head + mark + escape(bytes(data))
    (tmp_path / "t").write_text("".join(f"{line}\n" for line in (first, *lines)))
    assert compared(tmp_path / "t", *words).exit_code == 1


def record_bus(path: Path, supply_v: float = 24.0) -> None:
    """Record a master that starts a drive and an I/O module."""
    wire = CanWire(500_000)
    nodes = [Node("5", make_epos(5), wire), Node("3", make_f_palette(3), wire)]
    rig = Rig(*(Station(node, node.port) for node in nodes))
    nodes[0].inputs.set("supply_v", supply_v)
    link = RecordingLink(CanHost(rig, wire.end()), path, name="can0")

    def wait(duration_us: int) -> None:
        until_us = link.now_us + duration_us
        while link.now_us < until_us:
            link.receive_stamped(until_us - link.now_us)

    wait(20_000)
    for frame in (
        "605#2B17100064000000",
        "605#2300180181010080",
        "605#2300180182030000",
        "605#2F60600003000000",
        "605#23FF600010270000",
        "000#0100",
        "605#2B40600006000000",
        "605#2B40600007000000",
        "605#2B4060000F000000",
    ):
        link.send((CanFrame.parse(frame),))
        wait(20_300)
    inputs = nodes[1].signal("0x6000:1")
    assert inputs
    inputs.write(5)
    link.note("3/0x6000:1", 5)
    wait(300_000)
    link.close()


def test_a_recorded_bus_is_the_same(tmp_path: Path) -> None:
    record_bus(tmp_path / "t")
    turning = ("--number", "382#*[2:6]=300")
    result = compared(tmp_path / "t", "--node", "5=epos", "--node", "3=f-palette", *turning)
    assert result.exit_code == 0, result.output
    assert "can0 183 " in result.stdout  # of a hand at the inputs
    assert "can0 382 " in result.stdout  # a COB-ID that the master has set
    assert "can0 705 " in result.stdout


def test_a_node_that_does_otherwise_is_found(tmp_path: Path) -> None:
    record_bus(tmp_path / "t", supply_v=6.0)
    result = compared(tmp_path / "t", "--node", "5=epos", "--node", "3=f-palette")
    assert result.exit_code == 1
    assert "can0 085" in result.stdout


@pytest.mark.parametrize(
    ("trace", "words", "message"),
    [
        ("nothing", [], "trace .*: No such file or directory"),
        ("text", [], "line 1 is not"),
        ("rrc", ["--type", "toaster"], "no device type 'toaster'; known: rrc"),
        ("untyped", [], "it does not say of which type the device is: add --type"),
        ("bus", [], "which nodes were on the bus\\? add --node"),
        ("bus", ["--node", "5=nope.eds"], "file nope.eds: No such file"),
        ("rrc", ["--number", "x"], "--number: 'x' is not PATTERN=TOLERANCE"),
        ("rrc", ["--tolerance", "x"], "--tolerance 'x' is not a time"),
        ("rrc", ["--config", "x"], "--config: 'x' is not NAME=VALUE"),
        ("rrc", ["--node", "5=epos"], "--node does nothing here: this is a recording of a port"),
        ("bus", ["--type", "rrc", "--node", "5=epos"], "--type does nothing here: this is a"),
        ("silent", [], "no device says anything in it that could be compared"),
    ],
)
def test_what_cannot_be_compared_is_said_in_a_line(
    tmp_path: Path, trace: str, words: list[str], message: str
) -> None:
    path = tmp_path / trace
    if trace in ("rrc", "untyped"):
        record_rrc(path)
        path.write_text(path.read_text().replace(', "type": "rrc"' * (trace == "untyped"), ""))
    if trace == "bus":
        record_bus(path)
    if trace == "text":
        path.write_text("hello\n")
    if trace == "silent":
        record_rrc(path)
        lines = path.read_text().splitlines()
        path.write_text("".join(f"{line}\n" for line in lines if " < " not in line))
    result = compared(path, *words)
    assert result.exit_code == 2
    assert re.search(message, result.stderr)
    assert len(result.stderr.splitlines()) == 1


def test_no_damage_of_a_trace_ends_in_a_traceback(tmp_path: Path) -> None:
    record_rrc(tmp_path / "rrc")
    record_bus(tmp_path / "bus")
    chance = Random(1)
    for name in ("rrc", "bus"):
        data = (tmp_path / name).read_bytes()
        for _ in range(60):
            damaged = spoilt(data, chance)
            if re.search(rb"^\d{3,}\.", damaged, re.MULTILINE):
                continue  # a run of many minutes
            (tmp_path / "spoilt").write_bytes(damaged)
            result = compared(tmp_path / "spoilt", "--node", "5=epos", "--node", "3=f-palette")
            assert result.exit_code in (0, 1, 2)
            assert len(result.stderr.splitlines()) <= 1

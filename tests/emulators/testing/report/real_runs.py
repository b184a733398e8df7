"""Test records of runs that have happened: an RRC and an EPOS drive, in virtual time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.bench.operator import FaultSpec
from tickrig.emulators.bench.running_emulator import RunningEmulator, Transcript
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import describe_nodes, make_bench, make_nodes
from tickrig.emulators.canopen.node_spec import NodeSpec
from tickrig.emulators.record.recorder import CandumpFile, TraceFile
from tickrig.emulators.rrc.device_type import RRC
from tickrig.emulators.scenario import Clear, ScenarioParser, ScenarioPlayer, ScenarioStep
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.testing.commands.canopen_run import parse_send
from tickrig.emulators.testing.plugin.bench_evidence import SignalSampler
from tickrig.emulators.testing.report.bench_report import (
    JournalLine,
    Outcome,
    PlannedFault,
    TestRecord,
)
from tickrig.host.text.trace import Header
from tickrig.host.text.values import parse_time_us
from tickrig.wire.instant import NEVER

GOLDEN = Path(__file__).parents[3] / "golden" / "scenario"

DRIVE = """
0.1s    press power_button
500ms   send limit3232ffffff      # at most 50 %
+0s     expect OK:limit within 50ms
0.6s    set stick 100 -20
0.8s    fault bus_unplugged@800ms-1200ms
+0s     expect EV:PowerOffWaitBy* within 200ms
1.4s    end
"""

MOVE = """
10ms    send 000#0101
20ms    send 601#2F60600001000000
30ms    send 601#2B40600006000000
40ms    send 601#2B40600007000000
50ms    send 601#2B4060000F000000
60ms    send 601#237A600020A10700
70ms    send 601#2B4060001F000000
400ms   set shaft_blocked 1
+0ms    expect 081#* within 800ms
1.5s    end
"""


def play(
    nodeid: str,
    emulator: RunningEmulator,
    steps: Sequence[ScenarioStep],
    signals: Sequence[str],
) -> TestRecord:
    """Play a scenario, and say how it was."""
    lines: list[str] = []
    sampler = SignalSampler(emulator.device, signals)
    emulator.after_step.append(lambda _: sampler.take(emulator.rig.now_us))
    player = ScenarioPlayer(emulator, steps, Transcript(emulator, lines.append))
    while emulator.running:
        emulator.step()
    emulator.close()
    journal = tuple(journal_line(line) for line in lines)
    missed = [line.text for line in journal if line.mark == "?"]
    return TestRecord(
        nodeid,
        Outcome.FAILED if player.missed else Outcome.PASSED,
        mode="virtual",
        virtual_us=emulator.rig.now_us,
        reason=missed[0] if missed else "",
        faults=tuple(planned_faults(steps)),
        journal=journal,
        series=sampler.series(),
    )


def journal_line(line: str) -> JournalLine:
    time, mark, text = (*line.split(" ", 2), "")[:3]
    return JournalLine(parse_time_us(time), "", mark, text)


def planned_faults(steps: Sequence[ScenarioStep]) -> Iterator[PlannedFault]:
    """Yield the faults of a scenario, each until it ends or is cleared."""
    cleared = {step.what.name: step.at_us for step in steps if isinstance(step.what, Clear)}
    for step in steps:
        if isinstance(spec := step.what, FaultSpec):
            to_us = cleared.get(spec.name) if spec.to_us == NEVER else spec.to_us
            yield PlannedFault(spec.text, max(spec.from_us, step.at_us or 0), to_us)


RRC_SIGNALS = ("state", "stick_v_pct", "out_v_pct", "out_w_pct", "buzzer")


def run_rrc(nodeid: str, scenario: str, trace: Path) -> TestRecord:
    """Play a scenario on an RRC, recorded."""
    rrc = Rrc()
    recorded = TraceFile(trace, Header("rrc", {"seed": 0}))
    emulator = Emulator("rrc", rrc, trace=recorded, line=RRC.line)
    parser = ScenarioParser(rrc, emulator.operator, RRC.encoders)
    record = play(nodeid, emulator, parser.parse(scenario, "drive.txt"), RRC_SIGNALS)
    return replace(record, trace=trace.read_text("ascii"), artefacts=(trace.name,))


WHEEL_SIGNALS = ("drive_state", "shaft_deg_s", "position", "current_a", "winding_c")


def run_epos(nodeid: str, scenario: str, candump: Path) -> TestRecord:
    """Play a scenario on an EPOS drive with node-ID 1."""
    wire = CanWire()
    nodes = make_nodes(describe_nodes([NodeSpec("epos", 1)]), wire)
    recorded = CandumpFile(candump, "can0")
    wire.observers.append(recorded.hear)
    emulator = make_bench(wire, nodes, trace=recorded)
    parser = ScenarioParser(emulator.device, emulator.operator, senders={"send": parse_send})
    record = play(nodeid, emulator, parser.parse(scenario, "wheel.txt"), WHEEL_SIGNALS)
    return replace(record, trace=candump.read_text("ascii"), artefacts=(candump.name,))

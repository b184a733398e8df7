"""Write a report of two runs in virtual time, and photograph it where there is a Chromium.

`python tools/report_picture.py docs/pictures/report.png`; without one
only `docs/pictures/report.html` is written.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from shutil import which

from tickrig import Bench
from tickrig.device import Rrc, make_epos
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.plugin.bench_evidence import SignalSampler
from tickrig.emulators.testing.report.bench_report import (
    BenchReport,
    JournalLine,
    Outcome,
    PlannedFault,
    Requirement,
    RunEnvironment,
    TestRecord,
)
from tickrig.emulators.testing.report.report_file import write_report
from tickrig.host.text.byte_text import escape

SIZE = "1000,1460"
CHAIR, WHEEL = "tests/test_chair.py::", "tests/test_wheel.py::"
BLOCKED = TestRecord(
    f"{WHEEL}test_stopping_distance",
    Outcome.BLOCKED,
    mode="real",
    wall_us=1_020_000,
    requirements=("SAF-10",),
    reason="the machine was too slow: a tick came 14 ms late, 2 ms are allowed",
)
REQUIREMENTS = (
    Requirement("SAF-9", "A blocked wheel is told within 50 ms"),
    Requirement("SAF-10", "The chair stops within 0.4 m"),
    Requirement("SAF-12", "A pulled bus stops the chair within 200 ms"),
)


def pulled_bus() -> TestRecord:
    """Pull the bus of a wheelchair that drives."""
    with Bench(Rrc(), seed=7) as bench:
        samplers = watch(bench, "state", "stick_v_pct", "out_v_pct")
        bench.fault("bus_unplugged@800ms-1200ms")
        bench.run_for("100ms")
        bench.press("power_button")
        bench.run_for("400ms")
        bench.link.send(b"limit3232ffffff\n")
        bench.run_for("100ms")
        bench.set("stick", 100, -20)
        bench.run_for("200ms")
        stopped = bench.wait_until(lambda: bench.get("state") == "PowerOffByOthers", "200ms")
        bench.run_for("400ms")
        fault = PlannedFault("bus_unplugged", 800_000, 1_200_000)
        name = f"{CHAIR}test_a_pulled_bus_stops_it"
        return told(bench, samplers, name, passed=stopped, requirement="SAF-12", fault=fault)


def blocked_shaft() -> TestRecord:
    """Hold the wheel of a drive that moves."""
    with Bench(wheel=make_epos(1), seed=7) as bench:
        samplers = watch(bench, "drive_state", "shaft_deg_s", "position", "current_a", "winding_c")
        bench.fault("shaft_blocked@400ms-900ms")
        emergency = bench.on_line("081#*")
        network = bench.canopen_network()
        bench.run_for("10ms")
        network.send_message(0, b"\x01\x01")
        for index, data in (
            (0x6060, b"\x01"),
            (0x6040, b"\x06\x00"),
            (0x6040, b"\x07\x00"),
            (0x6040, b"\x0f\x00"),
            (0x607A, b"\x20\xa1\x07\x00"),
            (0x6040, b"\x1f\x00"),
        ):
            command = 0x23 | (4 - len(data)) << 2
            sent = bytes([command, index & 0xFF, index >> 8, 0]) + data
            network.send_message(0x601, sent.ljust(8, b"\0"))
            bench.run_for("10ms")
        bench.run_for(400_000 - bench.now_us)
        said = bench.wait_until(emergency, "50ms")
        bench.run_for(1_200_000 - bench.now_us)
        fault = PlannedFault("shaft_blocked", 400_000, 900_000)
        name = f"{WHEEL}test_a_blocked_shaft_is_told"
        return told(bench, samplers, name, passed=said, requirement="SAF-9", fault=fault)


def watch(bench: Bench, *names: str) -> list[SignalSampler]:
    """Keep the values of signals from now on."""

    def begin(rig: BenchRig) -> list[SignalSampler]:
        sampler = SignalSampler(rig.device, names)
        rig.rig.watchers.append(sampler.take)
        return [sampler]

    return bench._mode.act(begin)


def told(  # noqa: PLR0913 - a picture
    bench: Bench,
    samplers: list[SignalSampler],
    nodeid: str,
    *,
    passed: bool,
    requirement: str,
    fault: PlannedFault,
) -> TestRecord:
    """Return the record of a test."""
    lines = bench._mode.journal()
    samplers[0].take(bench.now_us)
    return TestRecord(
        nodeid,
        Outcome.PASSED if passed else Outcome.FAILED,
        mode=bench.mode,
        virtual_us=bench.now_us,
        wall_us=bench.now_us // 100,
        seed=7,
        requirements=(requirement,),
        reason="" if passed else "no EMCY of node 1 within 50 ms of 0.400000",
        expected="" if passed else "an EMCY of node 1 within 50 ms",
        command=f"pytest {nodeid} --bench-mode virtual",
        faults=(fault,),
        journal=tuple(
            JournalLine(line.at_us, line.source, line.mark, escape(line.data)) for line in lines
        ),
        series=samplers[0].series(),
    )


def sample() -> BenchReport:
    """Return the report in the picture."""
    run = RunEnvironment("2026-11-22 14:00 UTC", "virtual", 7, platform="Linux")
    tests = (blocked_shaft(), BLOCKED, pulled_bus())
    return BenchReport("Wheelchair, nightly", (run,), tests, REQUIREMENTS)


def main() -> None:
    """Write the files."""
    picture = Path(sys.argv[1]).resolve()
    page = picture.with_suffix(".html")
    write_report(sample(), page)
    browser = which("chromium") or which("google-chrome")
    if browser is None:
        return
    options = ["--headless", "--no-sandbox", "--hide-scrollbars", f"--window-size={SIZE}"]
    subprocess.run([browser, *options, f"--screenshot={picture}", page.as_uri()], check=True)
    page.unlink()


if __name__ == "__main__":
    main()

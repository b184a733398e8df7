"""The lines of architecture.md, section 4, shown on the RRC."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.rrc import commands as cmd

ROOT = Path(__file__).parents[2]
Act = tuple[int, bytes | tuple[str, int]]
"""How long to wait in microseconds, then bytes to send or an input to set."""


def powered_on() -> list[Act]:
    return [(20_000, ("power_button", 1)), (20_000, ("power_button", 0)), (350_000, b"statusA1\n")]


@settings(deadline=None)
@given(st.binary(max_size=600), st.lists(st.integers(0, 600), max_size=8).map(sorted))
def test_chunking_within_a_tick_makes_no_difference(data: bytes, cuts: list[int]) -> None:
    def buffered(chunks: list[bytes]) -> tuple[int, int, list[bytes]]:
        buffer = Rrc()._buffer
        for chunk in chunks:
            buffer.push(chunk)
        lines = [buffer.pop() for _ in iter(buffer.__bool__, False)]
        return buffer.overflows, buffer.thrown_blocks, lines

    edges = [0, *cuts, len(data)]
    assert buffered([data[a:b] for a, b in pairwise(edges)]) == buffered([data])


@settings(deadline=None)
@given(st.lists(st.binary(max_size=200), max_size=30), st.booleans())
def test_any_bytes_leave_the_device_able_to_answer(chunks: list[bytes], on: bool) -> None:
    log_line, rrc = SerialLine(), Rrc()
    rig = Rig(Station(rrc, log_line.a))
    for wait_us, act in powered_on() if on else []:
        rig.run_for(wait_us)
        rrc.inputs.set(*act) if isinstance(act, tuple) else None
    for chunk in chunks:
        log_line.b.send(rig.now_us, chunk)
        rig.run_for(TICK_US)
    # An LF ends what noise began; stablemode, if noise switched it on, wants the CHECK digit.
    log_line.b.send(rig.now_us, b"\n")
    rig.run_for(400 * TICK_US)
    log_line.b.poll(rig.now_us)
    log_line.b.send(rig.now_us, b"device\n" + cmd.DeviceName().encode(check=True))
    rig.run_for(10 * TICK_US)
    assert b"RRC\n" in log_line.b.poll(rig.now_us)


def crosstalk(order: int) -> str:
    """Connect two RRCs to each other, so that each takes the other's replies for commands."""
    line = SerialLine()
    first, second = Rrc(), Rrc()
    stations = [Station(first, line.a), Station(second, line.b)]
    rig, log = Rig(*stations[order:], *stations[:order]), list[str]()
    for rrc, at_us in ((first, 30_000), (second, 55_000)):
        rig.run_to(at_us)
        rrc.inputs.set("power_button", 1)
    for _ in range(200):
        rig.run_for(7_000)
        log.append(f"{rig.now_us} {[*map(first.read, first.outputs)]}")
        log.append(f"{rig.now_us} {[*map(second.read, second.outputs)]}")
    assert len({*map(str, log)}) > 40  # they do disturb each other
    return hashlib.sha256("\n".join(log).encode()).hexdigest()


def test_the_order_of_listing_makes_no_difference() -> None:
    assert crosstalk(0) == crosstalk(1)


def test_a_run_is_the_same_in_another_process_and_under_another_hash_seed() -> None:
    program = "from tests.properties.test_rrc_determinism import crosstalk; print(crosstalk(0))"
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    for seed in ("0", "1"):
        done = subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.strip() == crosstalk(0)

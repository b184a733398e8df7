"""The lines of architecture.md, section 4, shown on the RRC."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from hypothesis import example, given, settings
from hypothesis import strategies as st

from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.device.rrc.terminals import INPUTS
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.rrc import commands as cmd

ROOT = Path(__file__).parents[2]
LINES = [
    *(command.encode() for command in (cmd.Limit(60, 70, 90, 40, 80), cmd.Output(30, -20))),
    *(cmd.Joystick(reverse_mode=mode).encode() for mode in range(4)),
    *(cmd.Watchdog(ticks).encode() for ticks in (0, 3, 30)),
    *(cmd.Status(on).encode() for on in (0, 1)),
    *(cmd.Beep((on, 3, 0, 2, 7, 0, 0, 0, 1, 1)).encode() for on in (0, 5)),
    *(b"stablemode1\n", b"stablemode00\n", b"device\n", b"hello\n", b"\n", b"x" * 90, b"\r\n"),
]

Act = tuple[int, bytes | tuple[str, int]]
"""How long to wait in microseconds, then bytes to send or an input to set."""

inputs = st.sampled_from([item for item in INPUTS if item.name != "rrc_power"]).flatmap(
    lambda item: st.tuples(st.just(item.name), st.integers(int(item.low), int(min(item.high, 100))))
)
waits = st.sampled_from([0, 1, 3_000, 10_000, 25_000, 100_000, 310_000, 1_500_000])
acts = st.lists(st.tuples(waits, st.sampled_from(LINES) | inputs), max_size=40)


def powered_on() -> list[Act]:
    return [(20_000, ("power_button", 1)), (20_000, ("power_button", 0)), (350_000, b"statusA1\n")]


def play(
    session: list[Act], *, dense: bool = False, send: Callable[[bytes], list[bytes]] | None = None
) -> list[tuple[object, ...]]:
    """Play a session on a rig and note everything that can be seen from outside."""
    line, rrc = SerialLine(), Rrc()
    rig, log = Rig(Station(rrc, line.a), dense=dense), list[tuple[object, ...]]()
    for wait_us, act in [*session, (2_000_000, b"")]:
        rig.run_for(wait_us)
        log.append((rig.now_us, line.b.poll(rig.now_us), *map(rrc.read, rrc.outputs)))
        if isinstance(act, bytes):
            for chunk in send(act) if send else [act]:
                line.b.send(rig.now_us, chunk)
        else:
            rrc.inputs.set(*act)
    return log


@settings(deadline=None, max_examples=150)
@example(False, [(0, ("speed_up_button", 1)), (10_000, ("power_button", 1))])
@given(st.booleans(), acts)
def test_dense_and_sparse_runs_are_the_same(begin: bool, session: list[Act]) -> None:
    session = powered_on() + session if begin else session
    assert play(session) == play(session, dense=True)


@settings(deadline=None, max_examples=50)
@given(acts, st.integers(1, 7))
def test_chunking_makes_no_difference(session: list[Act], size: int) -> None:
    def cut(data: bytes) -> list[bytes]:
        return [data[at : at + size] for at in range(0, len(data), size)]

    assert play(powered_on() + session, send=cut) == play(powered_on() + session)


@settings(deadline=None)
@given(st.binary(max_size=600), st.lists(st.integers(0, 600), max_size=8).map(sorted))
def test_chunking_within_a_tick_makes_no_difference(data: bytes, cuts: list[int]) -> None:
    def buffered(chunks: list[bytes]) -> tuple[int, list[bytes]]:
        buffer = Rrc()._buffer
        overflows = sum(map(buffer.push, chunks))
        return overflows, [buffer.pop() for _ in iter(buffer.__bool__, False)]

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

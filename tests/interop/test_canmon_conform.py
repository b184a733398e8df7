"""`canmon conform` at a slave of ours in a process of its own, over real buses."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.interop.buses import Bus
from tests.interop.slave import EDS, Slave, running
from tickrig import Bench
from tickrig.testing import conformance

pytestmark = pytest.mark.realtime

CANMON = (sys.executable, "-c", "from tickrig.commands import canmon; canmon()", "conform")
PATIENCE_S = 90.0
SOME = ("UE-*", "DE-0*", "NMT-03", "NMT-05", "SG-01")
UNDECIDED = ("inconclusive", "blocked")


@pytest.fixture
def board(bus: Bus) -> Iterator[Slave]:
    with running(bus, "--eds", str(EDS), "--node-id", "5") as child:
        yield child


def begin(bus: Bus, *words: str) -> subprocess.Popen[str]:
    """Begin a run, as a user does in a shell."""
    line = [*CANMON, *bus.arguments, "--node", "5", "--eds", str(EDS), "--yes", "--json", *words]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def report_of(run: subprocess.Popen[str]) -> tuple[int, dict[str, Any]]:
    out, err = run.communicate(timeout=PATIENCE_S)
    assert out, err
    said: dict[str, Any] = json.loads(out)
    return run.returncode, said


def only(*names: str) -> list[str]:
    return [word for name in names for word in ("--only", name)]


def wait_for(done: Callable[[], bool], run: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        assert run.poll() is None, run.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_the_verdicts_are_those_of_virtual_time(bus: Bus, board: Slave) -> None:
    status, said = report_of(begin(bus, "--communication", *only(*SOME)))
    real = {check["id"]: check["verdict"] for check in said["checks"]}
    with Bench(f"5={EDS}") as bench:
        report = conformance(bench, eds=EDS, level="communication", only=SOME)
    virtual = {one.check.id: str(one.outcome.verdict) for one in report.results}
    assert real.keys() == virtual.keys()
    judged = {name: verdict for name, verdict in real.items() if verdict not in UNDECIDED}
    assert judged == {name: virtual[name] for name in judged}
    assert status in (0, 4)
    assert said["unrestored"] == []


def test_ctrl_c_in_the_middle_restores_what_was_changed(bus: Bus, board: Slave) -> None:
    run = begin(bus, "--communication", *only("NMT-*", "HB-*"))
    wait_for(lambda: board.get("0x1017") == 100, run)
    run.send_signal(signal.SIGINT)
    status, said = report_of(run)
    assert status == 130
    assert said["aborted"] == "interrupted"
    assert said["unrestored"] == []
    board.wait_for("0x1017", 0)


def test_a_node_that_stands_still_is_blocked_and_has_not_failed(bus: Bus, board: Slave) -> None:
    run = begin(bus, "--communication", *only("HB-01", "HB-02"))  # HB-01 holds it for two seconds
    wait_for(lambda: board.get("0x1017") == 100, run)
    board.process.send_signal(signal.SIGSTOP)
    try:
        status, said = report_of(run)
    finally:
        board.process.send_signal(signal.SIGCONT)
    assert status == 4
    assert said["counts"]["fail"] == 0
    assert said["counts"]["blocked"] > 0
    assert said["unrestored"] == ["1017h:00 was 0000; not verified: the node was lost"]


def test_a_tester_that_was_stopped_calls_no_silence_a_failure(bus: Bus, board: Slave) -> None:
    run = begin(bus, "--communication", *only("NMT-03", "NMT-05"))
    wait_for(lambda: board.get("0x1017") == 100, run)
    run.send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    run.send_signal(signal.SIGCONT)
    status, said = report_of(run)
    assert status in (0, 4)
    assert said["counts"]["fail"] == 0
    board.wait_for("0x1017", 0)


def test_a_control_socket_moves_inputs_errors_and_power(bus: Bus, board: Slave) -> None:
    names = only("NMT-01", "EM-01", "EM-02", "EM-03", "PR-01")
    stimulus = ("--stimulus", f"control:{board.control}")
    status, said = report_of(begin(bus, "--intrusive", *stimulus, *names))
    verdicts = {check["id"]: check["verdict"] for check in said["checks"]}
    assert verdicts.keys() == {"NMT-01", "EM-01", "EM-02", "EM-03", "PR-01"}
    assert status in (0, 4), said
    assert said["counts"]["not applicable"] == 0, verdicts

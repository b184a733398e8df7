"""`top`, `stats` and `check` on a bus, and what is left of a terminal after a crash."""

from __future__ import annotations

import subprocess
import sys
import termios
from collections.abc import Iterator

import can
import pexpect
import pytest

from tests.interop.buses import GROUP, PORT
from tickrig.host.canmon.output.listening import ENTER, LEAVE

pytestmark = pytest.mark.realtime

PATIENCE_S = 20.0
BUS = (f"udp:{GROUP}", "--bus-kwargs", f"port={PORT}")
PROGRAM = "from tickrig.host.canmon.cli import main; main()"
HEARTBEAT = can.Message(arbitration_id=0x703, data=b"\x05", is_extended_id=False)


@pytest.fixture
def heartbeats() -> Iterator[None]:
    with can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0) as bus:
        bus.send_periodic(HEARTBEAT, 0.05)
        yield


def canmon(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", PROGRAM, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def test_a_table_of_a_bus_needs_no_terminal(heartbeats: None) -> None:
    ran = canmon("top", *BUS, "--for", "1s")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.splitlines()[-1].startswith("703")


def test_statistics_of_a_bus(heartbeats: None) -> None:
    ran = canmon("stats", *BUS, "--for", "1s", "--by", "node")
    assert ran.returncode == 0
    assert ran.stdout.splitlines()[-1].split()[1:3] == ["3", "1"]


def test_a_bus_is_checked_for_a_time(heartbeats: None) -> None:
    words = ("check", *BUS, "--for", "1s", "--no-loss", "--nodes")
    ran = canmon(*words, "3")
    assert (ran.returncode, ran.stdout, ran.stderr) == (
        *(0, "", "judged: no-loss, nodes\nall rules hold\n"),
    )
    ran = canmon(*words, "3-4")
    assert (ran.returncode, ran.stderr) == (1, "judged: no-loss, nodes\n1 finding: nodes: 1\n")
    assert ran.stdout.endswith(" nodes: node 4 was never seen\n")


def test_a_bus_that_is_not_there_ends_with_3() -> None:
    ran = canmon("top", "socketcan:no_such_bus")
    assert ran.returncode == 3
    assert len(ran.stderr.splitlines()) == 1


def test_a_crash_leaves_the_terminal_as_it_was() -> None:
    program = (
        "from tickrig.host.canmon.output.listening import _Screen as Screen\n"
        "with Screen() as screen:\n"
        "    screen.paint(['all is well'])\n"
        "    raise ValueError('it is not')\n"
    )
    child = pexpect.spawn(sys.executable, ["-c", program], encoding="utf-8", timeout=PATIENCE_S)
    before = termios.tcgetattr(child.child_fd)[3]
    for text in (ENTER, "all is well", LEAVE, "Traceback", "ValueError: it is not"):
        child.expect_exact(text)
    assert termios.tcgetattr(child.child_fd)[3] == before
    child.expect(pexpect.EOF)
    child.close()

"""What `canmon conform` asks at a terminal, and where there is none; on a bus without a node."""

from __future__ import annotations

import subprocess
import sys

import pexpect
import pytest

pytestmark = pytest.mark.realtime

WORDS = [
    *("-c", "from tickrig.commands import canmon; canmon()", "conform", "virtual:nobody"),
    *("--node", "5", "--communication", "--only", "NMT-03"),
]
PATIENCE_S = 60


def at_terminal() -> pexpect.spawn[str]:
    child: pexpect.spawn[str] = pexpect.spawn(
        sys.executable, WORDS, encoding="utf-8", timeout=PATIENCE_S, dimensions=(24, 200)
    )
    child.expect_exact("node 5 is started, stopped")
    child.expect_exact("what it drives may move, other nodes may trip")
    child.expect_exact("Go on? [y/N]:")
    return child


def test_no_begins_nothing() -> None:
    child = at_terminal()
    child.sendline("")
    child.expect_exact("Error: not started")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 2


def test_yes_begins_and_shows_how_far_it_is() -> None:
    child = at_terminal()
    child.sendline("y")
    child.expect_exact("node 5 is read")
    child.expect_exact("1 check, 0 failures: NMT-03")
    child.expect_exact("Error: node 5 does not answer; other nodes: none")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 4


def test_in_a_pipe_it_refuses_and_says_how() -> None:
    done = subprocess.run(
        [sys.executable, *WORDS], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 2
    assert "There is no terminal to ask: give --yes, or --read-only" in done.stderr
    assert not done.stdout


def test_without_a_node_it_says_who_was_heard() -> None:
    line = [*WORDS[:4], "-i", "virtual"]
    done = subprocess.run(
        [sys.executable, *line], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert (done.returncode, done.stdout) == (5, "")
    assert done.stderr.startswith("no frames within 1.5 s; a node that sends")

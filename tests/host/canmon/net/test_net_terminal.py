"""What `canmon net` asks at a terminal, and where there is none; on a bus without a node."""

from __future__ import annotations

import subprocess
import sys

import pexpect
import pytest

pytestmark = pytest.mark.realtime

NET = ["-c", "from tickrig.commands import canmon; canmon()", "net"]
BUS = [*NET, "--timeout", "50ms", "virtual:nobody"]
PATIENCE_S = 60


def test_no_begins_nothing_and_yes_begins() -> None:
    for answer, status, told in (
        ("", 2, "Error: not started"),
        ("y", 1, "Error: node 5: sent, but nothing answers as node 5"),
    ):
        child = pexpect.spawn(
            sys.executable,
            [*BUS, "nmt", "start", "5"],
            encoding="utf-8",
            timeout=PATIENCE_S,
            dimensions=(24, 200),
        )
        child.expect_exact("NMT start to node 5. This may turn a motor")
        child.expect_exact("Go on? [y/N]:")
        child.sendline(answer)
        child.expect_exact(told)
        child.expect(pexpect.EOF)
        child.close()
        assert child.exitstatus == status


def run(*words: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert not done.stdout
    return done.returncode, done.stderr


def test_in_a_pipe_it_refuses_and_says_how() -> None:
    status, said = run(*BUS, "nmt", "start", "all")
    assert status == 2
    assert "This may turn a motor" in said
    assert said.endswith("There is no terminal to ask: give --yes\n")


def test_a_node_that_is_silent_is_told() -> None:
    told = (1, "Error: node 5: no answer within 50 ms to the read of 1000h that each node has\n")
    assert run(*BUS, "read", "5", "1000h") == told
    assert run(*NET, "--timeout", "50ms", "-i", "virtual", "read", "5", "1000h") == told


def test_ctrl_c_says_what_was_not_done() -> None:
    child = pexpect.spawn(
        sys.executable, [*BUS, "nmt", "reset-node", "5", "--yes"], encoding="utf-8", timeout=60
    )
    child.expect_exact("a suspended load may fall")
    child.sendintr()
    child.expect_exact("interrupted")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 130

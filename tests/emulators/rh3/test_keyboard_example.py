"""examples/rh3_keyboard.py in a terminal, over a base on a pty."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pexpect
import pytest

from tickrig.emulators.bench.child import running
from tickrig.host.control.client import ControlClient

pytestmark = pytest.mark.realtime

EXAMPLE = Path(__file__).parents[3] / "examples" / "rh3_keyboard.py"
PATIENCE_S = 30.0


def environment() -> dict[str, str]:
    paths = os.pathsep.join(path for path in sys.path if path)
    return {**os.environ, "PYTHONPATH": paths}  # type: ignore[dict-item, unused-ignore]


def test_a_key_drives_the_base_and_ctrl_c_ends() -> None:
    with running("tickrig.emulators.rh3.cli") as base, ControlClient(base.control) as control:
        words = [str(EXAMPLE), str(base.link)]
        keys = pexpect.spawn(sys.executable, words, env=environment(), encoding="utf-8")
        deadline_s = time.monotonic() + PATIENCE_S
        while control.request("get", names=["x_m"])["values"]["x_m"] < 0.02:  # type: ignore[index]
            assert time.monotonic() < deadline_s
            keys.send("w")
        keys.kill(signal.SIGINT)
        keys.expect(pexpect.EOF, timeout=PATIENCE_S)
        keys.close()
        assert keys.exitstatus == 0
        while control.request("get", names=["speed_m_s"])["values"]["speed_m_s"]:  # type: ignore[index]
            assert time.monotonic() < deadline_s

"""`rtc-lite-emu` in a process of its own, asked through its terminal."""

from __future__ import annotations

import time

import pytest
import serial

from tests.wire.rtc_lite.vectors import VECTORS, raw
from tickrig.emulators.bench.child import running
from tickrig.host.control.client import ControlClient

TIMEOUT_S = 5.0


@pytest.mark.realtime
def test_a_host_starts_a_node_up_and_loses_it_by_a_power_cut() -> None:
    start_up = next(row for row in VECTORS["dialogues"] if row["id"] == "L01")
    with (
        running("tickrig.emulators.rtc_lite.cli", "--node", "echo") as child,
        ControlClient(child.control) as hand,
        serial.Serial(str(child.link), 57_600, timeout=TIMEOUT_S) as port,
    ):
        for step in start_up["steps"]:
            expected = raw(*step["device"])
            port.write(raw(step["proxy"]))
            assert port.read(len(expected)) == expected
        hand.request("fault", spec="power_cut")
        port.timeout = 0.1
        port.write(raw("0A 43 58 9B"))
        assert port.read(1) == b""
        hand.request("clear", name="power_cut")
        port.timeout = TIMEOUT_S
        deadline_s = time.monotonic() + TIMEOUT_S
        while hand.request("get", names=["state"])["values"] != {"state": "Created"}:
            assert time.monotonic() < deadline_s
        port.write(raw("0A 43 58 9B"))
        assert port.read(6) == raw("0A 43 58 40 43 1E")

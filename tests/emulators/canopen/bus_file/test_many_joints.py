"""Thirty-two joints of one bus.yml in csp, with a SYNC each 10 ms, on a bus of 1 Mbit/s."""

from __future__ import annotations

from collections import Counter
from math import cos
from pathlib import Path

import can
import pytest

from tests.emulators.canopen.bus_file.system import write_system
from tickrig import open_bench

JOINTS = 32
HEAD = """\
options:
  tickrig: {configured: true}
master:
  node_id: 127
  sync_period: 10000
defaults:
  dcf: joint.eds
  sdo:
    - {index: 0x60C2, sub_index: 1, value: 10}
    - {index: 0x60C2, sub_index: 2, value: -3}
    - {index: 0x6060, value: 8}
  tpdo:
    1: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6041}, {index: 0x6064}]}
  rpdo:
    1: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6040}, {index: 0x607A}]}
nodes:
"""


def joints(folder: Path) -> Path:
    nodes = "".join(f"  joint_{number}: {{node_id: {number}}}\n" for number in range(1, JOINTS + 1))
    return write_system(folder, HEAD + nodes)


def test_thirty_two_joints_keep_a_sync_of_10_ms(tmp_path: Path) -> None:
    with open_bench(joints(tmp_path)) as bench, bench.can_bus() as bus:
        heard: Counter[int] = Counter()

        def send(can_id: int, data: bytes = b"") -> None:
            bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

        def cycle(controlword: int, target: int) -> None:
            order = controlword.to_bytes(2, "little") + target.to_bytes(4, "little", signed=True)
            for number in range(1, JOINTS + 1):
                send(0x200 + number, order)
            send(0x80)
            bench.run_for("10ms")
            while message := bus.recv(0):
                heard[message.arbitration_id] += 1

        bench.run_for("20ms")
        send(0x000, b"\x01\x00")
        for controlword in (0x06, 0x07, 0x0F, 0x0F):
            cycle(controlword, 0)
        heard.clear()
        for step in range(100):
            cycle(0x0F, round(250 * (1 - cos(step * 0.02))))
        assert {can_id: heard[can_id] for can_id in range(0x181, 0x181 + JOINTS)} == dict.fromkeys(
            range(0x181, 0x181 + JOINTS), 100
        )
        last = 250 * (1 - cos(98 * 0.02)) / 1_000
        for number in range(1, JOINTS + 1):
            shaft_deg = bench[f"joint_{number}"].get("shaft_deg")
            assert shaft_deg == pytest.approx(last * 57.3, abs=0.6)

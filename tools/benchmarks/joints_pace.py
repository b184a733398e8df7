"""How many joints of a bus.yml keep a SYNC of 10 ms in real time, over python-can's UDP.

A process of its own runs `canopen-slave-emu --bus`; this one is the master: an RPDO for each
joint, then SYNC, and a TPDO of each comes back. The emulated wire has 1 Mbit/s: an RPDO and a
TPDO of each of 32 joints take 7 of the 10 ms. The processor is that of the emulator.
"""

from __future__ import annotations

import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

import can

from benchmarks.table import percentiles

JOINTS: Final = (8, 16, 32)
CYCLE_S: Final = 0.01
CHANNEL: Final = "ff11::7469:636b"
EDS: Final = Path(__file__).parents[2] / "examples" / "ros2_canopen" / "joint.eds"
PROGRAM: Final = (
    "from tickrig.emulators.canopen.cli import main; main(prog_name='canopen-slave-emu')"
)
BUS: Final = """\
master: {node_id: 127, sync_period: 10000}
defaults:
  dcf: joint.eds
  tickrig: {configured: true}
  sdo:
    - {index: 0x6060, value: 8}
    - {index: 0x60C2, sub_index: 1, value: 10}
    - {index: 0x60C2, sub_index: 2, value: -3}
  tpdo:
    1: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6041}, {index: 0x6064}]}
    2: {enabled: false}
    3: {enabled: false}
    4: {enabled: false}
  rpdo:
    1: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6040}, {index: 0x607A}]}
nodes:
"""
CLOCK: Final = os.sysconf("SC_CLK_TCK")


class Joints:
    """The master of some joints.

    Args:
        bus: where they are.
        count: how many.
    """

    def __init__(self, bus: can.BusABC, count: int) -> None:
        self._bus, self._count = bus, count

    def enable(self) -> None:
        """Start the nodes, and switch the drives on."""
        self._send(0, bytes((1, 0)))
        for controlword in (6, 7, 15):
            for _ in range(20):
                self.cycle(controlword, 0, time.monotonic() + CYCLE_S)

    def cycle(self, controlword: int, target: int, until_s: float) -> tuple[int, float]:
        """Send targets and SYNC; return how many TPDOs came by then, and when the last one did."""
        data = controlword.to_bytes(2, "little") + target.to_bytes(4, "little", signed=True)
        for node_id in range(1, self._count + 1):
            self._send(0x200 + node_id, data)
        begun_s = time.monotonic()
        self._send(0x80, b"")
        return self.hear(begun_s, until_s)

    def hear(self, begun_s: float, until_s: float) -> tuple[int, float]:
        """Count TPDOs up to a time; say how long after another one the last came."""
        heard, last_s = 0, 0.0
        while (left_s := until_s - time.monotonic()) > 0:
            message = self._bus.recv(left_s)
            if message is not None and 0x180 < message.arbitration_id < 0x200:
                heard, last_s = heard + 1, time.monotonic() - begun_s
        return heard, last_s

    def _send(self, can_id: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))


def run(seconds: float) -> None:
    """Print a row for each number of joints."""
    for count in JOINTS:
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(EDS, folder)
            nodes = "".join(f"  joint_{n}: {{node_id: {n}}}\n" for n in range(1, count + 1))
            path = Path(folder, "bus.yml")
            path.write_text(BUS + nodes)
            measure(count, int(seconds / len(JOINTS) / CYCLE_S), path)


def measure(count: int, cycles: int, path: Path) -> None:
    """Run the joints, and be their master."""
    words = [
        "--bus",
        str(path),
        "-i",
        "udp_multicast",
        "-c",
        CHANNEL,
        "--bus-kwargs",
        "hop_limit=0",
    ]
    program = [sys.executable, "-c", PROGRAM, *words]
    with (
        subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as emulator,
        can.Bus(interface="udp_multicast", channel=CHANNEL, hop_limit=0) as bus,
    ):
        assert emulator.stderr is not None
        while "Ctrl-C ends" not in emulator.stderr.readline():
            assert emulator.poll() is None
        joints = Joints(bus, count)
        joints.enable()
        spent_s, begun_s = processor_s(emulator.pid), time.monotonic()
        came = [
            joints.cycle(15, target(number), begun_s + (number + 1) * CYCLE_S)
            for number in range(cycles)
        ]
        share = (processor_s(emulator.pid) - spent_s) / (time.monotonic() - begun_s)
        late, _ = joints.hear(time.monotonic(), time.monotonic() + 10 * CYCLE_S)
        emulator.send_signal(signal.SIGINT)
        ended = emulator.stderr.read().splitlines()[-1]
    told(count, came, late, share)
    print(f"|  the emulator: {ended} | | |")


def told(count: int, came: list[tuple[int, float]], late: int, share: float) -> None:
    """Print what came of a run, in its cycles and behind the last of them."""
    heard = sum(heard for heard, _ in came) + late
    whole = sum(heard == count for heard, _ in came)
    percentiles(
        f"{count} joints, {heard} of {count * len(came)} TPDOs, in {whole} of {len(came)} cycles"
        f" before the next SYNC, {share:.2f} of a core: last TPDO",
        [1_000 * last_s for _, last_s in came],
        "ms",
    )


def target(cycle: int) -> int:
    """Return where the joints shall be."""
    return round(500 * (1 - math.cos(cycle * CYCLE_S * 2)))


def processor_s(pid: int) -> float:
    """Return the processor time of a process."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / CLOCK

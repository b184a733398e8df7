"""The can-utils as foreign clients on real SocketCAN."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest

from tests.interop.buses import Bus, patience
from tests.interop.slave import EDS, running

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(not shutil.which("candump"), reason="no candump: apt-get install can-utils"),
]

OPTIONS = ("--eds", str(EDS), "--node-id", "5")
PATIENCE_S = patience(10)


class Candump:
    """`candump -L` on a bus, and what it has shown."""

    def __init__(self, bus: Bus, log: Path) -> None:
        self._log = log
        with log.open("wb") as out:
            self.process = subprocess.Popen(["candump", "-L", bus.channel], stdout=out)
        deadline = time.monotonic() + PATIENCE_S
        while not self._listens(bus):
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def _listens(self, bus: Bus) -> bool:
        """The kernel lists who reads from a bus; where nobody does, it says `(vcan0: no entry)`."""
        listed = Path("/proc/net/can/rcvlist_all").read_text("ascii")
        return re.search(rf"^ +{bus.channel} ", listed, re.MULTILINE) is not None

    @property
    def frames(self) -> list[str]:
        return re.findall(r"\(\d+\.\d+\) \S+ (\S+)\n", self._log.read_text("ascii"))

    def wait_for(self, frame: str, times: int = 1) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while self.frames.count(frame) < times:
            assert time.monotonic() < deadline, self.frames
            time.sleep(0.01)


@contextmanager
def candump(bus: Bus, folder: Path) -> Iterator[Candump]:
    dump = Candump(bus, folder / "candump.log")
    try:
        yield dump
    finally:
        dump.process.terminate()
        dump.process.wait()


def cansend(bus: Bus, frame: str) -> None:
    subprocess.run(["cansend", bus.channel, frame], check=True, timeout=PATIENCE_S)


@pytest.mark.essential
def test_candump_sees_the_boot_up_and_cansend_is_answered(vcan: Bus, tmp_path: Path) -> None:
    with candump(vcan, tmp_path) as dump, running(vcan, *OPTIONS) as slave:
        dump.wait_for("705#00")
        cansend(vcan, "605#4000100000000000")
        dump.wait_for("585#4300100091010F00")
        cansend(vcan, "000#0105")
        slave.wait_for("state", "Operational")
        cansend(vcan, "205#A500")
        slave.wait_for("0x6200:1", 0xA5)
        cansend(vcan, "605#2B17100032000000")
        dump.wait_for("585#6017100000000000")
        dump.wait_for("705#05")
        cansend(vcan, "000#8105")
        dump.wait_for("705#00", times=2)
    assert dump.frames.count("705#00") == 2


def test_many_nodes_hear_each_other_and_are_heard_once(vcan: Bus, tmp_path: Path) -> None:
    with (
        candump(vcan, tmp_path) as dump,
        running(vcan, "--node", f"1-20={EDS}") as slave,
    ):
        for node_id in range(1, 21):
            dump.wait_for(f"{0x700 + node_id:03X}#00")
        cansend(vcan, "000#0100")
        slave.wait_for("20/state", "Operational")
        cansend(vcan, "60A#4000100000000000")
        dump.wait_for("58A#4300100091010F00")
    assert dump.frames.count("70A#00") == 1
    assert dump.frames.count("58A#4300100091010F00") == 1


@pytest.mark.essential
def test_its_trace_is_read_by_python_can(vcan: Bus, tmp_path: Path) -> None:
    trace = tmp_path / "bus.log"
    with running(vcan, *OPTIONS, "--trace", str(trace)) as slave:
        cansend(vcan, "605#4000100000000000")
        slave.set("0x1017", 20)
        time.sleep(0.2)
        status, _, said = slave.end(signal.SIGTERM)
    assert status == 0, said
    assert re.search(r"^ran \d+\.\d{3} s; late ticks: .*; frames lost: 0$", said, re.MULTILINE)
    with can.CanutilsLogReader(trace) as log:
        heard = [(m.channel, m.arbitration_id, bytes(m.data).hex()) for m in log]
    assert heard[0] == ("vcan0", 0x705, "00")
    assert ("vcan0", 0x605, "4000100000000000") in heard
    assert ("vcan0", 0x585, "4300100091010f00") in heard

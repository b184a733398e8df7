"""Our slave in a process of its own, as a user starts it."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.interop.buses import Bus, patience
from tickrig.host.control.client import ControlClient

EDS = Path(__file__).parents[1] / "golden" / "canopen" / "r1.eds"
PROGRAM = "from tickrig.emulators.canopen.cli import main; main(prog_name='canopen-slave-emu')"
START_S = patience(30)
PATIENCE_S = patience(10)


@dataclass(frozen=True)
class Slave:
    """A running emulator.

    Attributes:
        process: the process.
        control: its control socket.
    """

    process: subprocess.Popen[str]
    control: Path

    def status(self) -> Any:
        with ControlClient(self.control, PATIENCE_S) as client:
            return client.request("status")

    def get(self, name: str) -> Any:
        with ControlClient(self.control, PATIENCE_S) as client:
            values: Any = client.request("get", names=[name])["values"]
            return values[name]

    def set(self, name: str, value: float | str) -> None:
        with ControlClient(self.control, PATIENCE_S) as client:
            client.request("set", name=name, value=value)

    def wait_for(self, name: str, value: float | str) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while (shown := self.get(name)) != value:
            assert time.monotonic() < deadline, f"{name} is {shown!r}, not {value!r}"
            time.sleep(0.01)

    def end(self, number: signal.Signals = signal.SIGINT) -> tuple[int, str, str]:
        if self.process.poll() is None:
            self.process.send_signal(number)
        out, err = self.process.communicate(timeout=START_S)
        return self.process.returncode, out, err


@contextmanager
def running(bus: Bus, *options: str) -> Iterator[Slave]:
    """Run it on a bus until the block ends."""
    with tempfile.TemporaryDirectory(prefix="tickrig-") as folder:
        control = Path(folder, "control")
        words = [*bus.arguments, "--control", str(control), *options]
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        slave = Slave(process, control)
        try:
            _wait_until_up(slave)
            yield slave
        finally:
            slave.end(signal.SIGKILL)


def _wait_until_up(slave: Slave) -> None:
    deadline = time.monotonic() + START_S
    while True:
        try:
            slave.status()
        except OSError:
            assert slave.process.poll() is None, slave.end()[2]
            assert time.monotonic() < deadline
            time.sleep(0.05)
        else:
            return

"""The RRC on a pty, against the wall clock: `rrc-emu` in a process of its own."""

from __future__ import annotations

import json
import os
import random
import select
import socket
import subprocess
import sys
import tempfile
import time
import tty
from collections import deque
from itertools import pairwise
from pathlib import Path

from benchmarks.table import percentiles
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rrc.commands import Output, Status

EMULATOR = "from tickrig.emulators.rrc.cli import main; main()"
PERIOD_S = 0.01


class Emulator:
    """A running rrc-emu, its terminal and its control socket."""

    def __init__(self, folder: Path) -> None:
        self._socket, terminal = folder / "control", folder / "tty"
        options = ["--link", str(terminal), "--control", str(self._socket)]
        # The emulator prints where it listens; the table is ours.
        self.process = subprocess.Popen(
            [sys.executable, "-c", EMULATOR, *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while not (terminal.exists() and self._socket.exists()):
            if self.process.poll() is not None:
                sys.exit(f"rrc-emu ended with status {self.process.returncode}")
            time.sleep(0.01)
        self.fd = os.open(terminal, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.fd)

    def ask(self, do: str, **fields: object) -> dict[str, int]:
        """Send one request to the control socket and return the answer."""
        with socket.socket(socket.AF_UNIX) as control:
            control.connect(str(self._socket))
            control.sendall(json.dumps({"v": 1, "do": do, **fields}).encode() + b"\n")
            answer: dict[str, int] = json.loads(control.makefile().readline())
            return answer

    def cpu_s(self) -> float:
        """Return the processor time that it has used."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(") ", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_mib(self) -> float:
        """Return its resident memory."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
        return int(line.split()[1]) / 1_024


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    with tempfile.TemporaryDirectory() as folder:
        emulator = Emulator(Path(folder))
        try:
            measure(emulator, seconds)
        finally:
            emulator.process.terminate()
            emulator.process.wait()


def measure(emulator: Emulator, seconds: float) -> None:
    """Stream status lines and confirmed commands, 100 of each a second."""
    emulator.ask("press", name="power_button")
    wait_for(emulator.fd, b"EV:PowerOnSuccess")
    cpu_s, start = emulator.cpu_s(), time.monotonic()
    time.sleep(1)
    idle = (emulator.cpu_s() - cpu_s) / (time.monotonic() - start)
    os.write(emulator.fd, Status(1).encode())
    wait_for(emulator.fd, b"SA:")
    cpu_s, start = emulator.cpu_s(), time.monotonic()
    arrivals, latencies, sent = stream(emulator.fd, seconds)
    busy = (emulator.cpu_s() - cpu_s) / (time.monotonic() - start)
    gaps = [1_000 * (b - a) for a, b in pairwise(arrivals)]
    percentiles(f"RRC on a pty, {seconds:g} s: status period", gaps, "ms")
    percentiles("command to OK", [1_000 * s for s in latencies], "ms")
    expected = round((arrivals[-1] - arrivals[0]) / PERIOD_S) + 1
    status = emulator.ask("status")
    print(f"| status lines lost | {expected - len(arrivals)} | of {expected} |")
    print(f"| commands without OK | {sent - len(latencies)} | of {sent} |")
    print(
        f"| late steps, bytes lost | {status['late_steps']}, {status['lost_bytes']} | latest by ",
        end="",
    )
    print(f"{status['late_us'] / 1_000:.4g} ms |")
    print(f"| processor, streaming | {100 * busy:.3g} % of a core | idle {100 * idle:.3g} % |")
    print(f"| memory of the process | {emulator.memory_mib():.3g} MiB | |")


def wait_for(fd: int, what: bytes) -> None:
    """Read until a line begins like this."""
    lines, deadline = LineSplitter(), time.monotonic() + 5
    while time.monotonic() < deadline:
        data = os.read(fd, 4_096) if select.select([fd], [], [], 0.1)[0] else b""
        if any(line.startswith(what) for line in lines.push(data)):
            return
    sys.exit(f"no {what!r} from the emulator in 5 s")


def stream(fd: int, seconds: float) -> tuple[list[float], list[float], int]:
    """Send a command at a random moment of each period; note when lines arrive."""
    chance, lines = random.Random(1), LineSplitter()
    arrivals, latencies, waiting = list[float](), list[float](), deque[float]()
    start = time.monotonic()
    due = [start + (n + chance.random()) * PERIOD_S for n in range(int(seconds / PERIOD_S))]
    sent = 0
    while (now := time.monotonic()) < start + seconds + 0.1:
        if sent < len(due) and now >= due[sent]:
            os.write(fd, Output(sent % 100, 0).encode())
            waiting.append(time.monotonic())
            sent += 1
        pause = max(0.0, due[sent] - now) if sent < len(due) else 0.05
        if not select.select([fd], [], [], pause)[0]:
            continue
        now = time.monotonic()
        for line in lines.push(os.read(fd, 4_096)):
            if line.startswith(b"SA:"):
                arrivals.append(now)
            elif line == b"OK:output":
                latencies.append(now - waiting.popleft())
    return arrivals, latencies, sent

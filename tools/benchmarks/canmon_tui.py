"""The share of a core that `canmon tui` takes for its screen, beside can_viewer of python-can.

All hear the same bus at the same time, over the loopback: 50 identifiers, payloads that change.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import can
import pexpect

from benchmarks.table import row

IDS = 50
FRAMES_S = 1_000
SIZE = (45, 120)
SETTLE_S = 3.0
RUNS = 5
GROUP = "ff11::7469:6d6f"
PORT = 41_000 + os.getpid() % 1_000
BUS = [f"udp:{GROUP}", "--bus-kwargs", f"port={PORT}"]
TUI = [sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()", "tui", *BUS]
INGEST = [
    sys.executable,
    "-c",
    f"""
import time
from tickrig.host.canmon.tui.session import Model
from tickrig.host.canmon.tui.session import open_session
from tickrig.host.cli.can_options import BusOptions
session = open_session(["udp:{GROUP}"], BusOptions(bus_kwargs=("port={PORT}",)), Model())
session.start()
print("ready", flush=True)
time.sleep(1_000)
""",
]
VIEWER = [sys.executable, "-m", "can.viewer", "-i", "udp_multicast", "-c", GROUP]
VIEWER += ["--bus-kwargs", f"port={PORT}", "hop_limit=0"]
TABS = {"nodes": "2", "trace, overwrite": "o", "statistics": "3", "trace": ""}
"""Tabs, and what is pressed to see them."""


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    ingest: list[float] = []
    viewer: list[float] = []
    beyond: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder, _traffic():
        env = {**os.environ, "TERM": "xterm-256color", "PYTHONPYCACHEPREFIX": folder}
        for name in ("COLUMNS", "LINES", "PYTHONDONTWRITEBYTECODE"):
            env.pop(name, None)
        for tab, keys in TABS.items():
            children = [
                _start(INGEST, "ready", "", env),
                _start(TUI, "LISTEN-ONLY", keys, env),
                _start(VIEWER, "Count", "", env),
            ]
            alone, shown, other = _shares(children, seconds / RUNS)
            ingest, viewer = ingest + alone, viewer + other
            beyond[tab] = [one - base for one, base in zip(shown, alone, strict=True)]
            for child in children:
                child.terminate(force=True)
    what = f"{FRAMES_S} frames/s, {IDS} identifiers"
    row(f"{what}: the session alone, no screen", ingest, "% of a core")
    for tab, values in beyond.items():
        row(f"{what}: screen of canmon tui, {tab}, beyond that", values, "% of a core")
    row(f"{what}: can_viewer of python-can, all of it", viewer, "% of a core")


def _shares(children: Sequence[pexpect.spawn[str]], span_s: float) -> list[list[float]]:
    """Return the share of a core that each takes, in spans beside each other."""
    time.sleep(SETTLE_S)
    shares: list[list[float]] = [[] for _ in children]
    for _ in range(RUNS):
        before, start = [_cpu_s(child) for child in children], time.perf_counter()
        time.sleep(span_s)
        took_s = time.perf_counter() - start
        for values, child, was in zip(shares, children, before, strict=True):
            values.append((_cpu_s(child) - was) * 100 / took_s)
    return shares


def _start(command: list[str], text: str, keys: str, env: Mapping[str, str]) -> pexpect.spawn[str]:
    child = pexpect.spawn(command[0], command[1:], dimensions=SIZE, env=dict(env), encoding="utf-8")
    child.expect_exact(text, timeout=60)
    child.send(keys)
    threading.Thread(target=_read, args=(child,), daemon=True).start()
    return child


def _read(child: pexpect.spawn[str]) -> None:
    """Take what it writes, as a terminal does."""
    try:
        while True:
            child.read_nonblocking(65_536, timeout=1)
    except pexpect.TIMEOUT:
        _read(child)
    except (pexpect.EOF, OSError, ValueError):
        return


def _cpu_s(child: pexpect.spawn[str]) -> float:
    """Return the time that the processor has spent on a process, all its threads."""
    fields = Path(f"/proc/{child.pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def _traffic() -> Iterator[None]:
    """Send frames until the block ends."""
    stop = threading.Event()

    def send() -> None:
        with can.Bus(
            interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0, receive_own_messages=0
        ) as bus:
            count, due_s = 0, time.perf_counter()
            while not stop.is_set():
                data = count.to_bytes(8, "little")
                bus.send(
                    can.Message(arbitration_id=0x181 + count % IDS, data=data, is_extended_id=False)
                )
                count, due_s = count + 1, due_s + 1 / FRAMES_S
                time.sleep(max(0.0, due_s - time.perf_counter()))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()

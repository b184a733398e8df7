"""A system that is joined with ROS 2 on a domain of its own, and peers in other processes."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from tickrig.host.cli.engine_options import EngineOptions, Ros2Options
from tickrig.host.rtc import Manager
from tickrig.host.rtc.engines.engines_joined import engines_joined
from tickrig.host.rtc.system.call_queue import CallQueue

CHAIN = """
[[component]]
name = "ConsoleIn0"
type = "ConsoleIn"
active = true

[[component]]
name = "ConsoleOut0"
type = "ConsoleOut"
active = true
"""
"""A system file for `tickrig rtc run`: what is typed, and what is shown."""

DEADLINE_S = 30.0
"""Far more than anything here takes."""

PERIOD_US = 1_000
PEER = Path(__file__).with_name("peer.py")


@contextmanager
def own_domain() -> Iterator[int]:
    """Give a domain that no other test has at present: a listening socket says so."""
    for domain in range(20, 100):
        with contextlib.suppress(OSError), socket.socket() as lock:
            lock.bind(("127.0.0.1", 7_400 + 250 * domain))
            yield domain
            return
    raise AssertionError("no domain is free")


class Peer:
    """`peer.py` in a process of its own, or another program that obeys the same commands."""

    def __init__(
        self,
        domain: int,
        command: Sequence[str] = (sys.executable, str(PEER)),
        environment: Mapping[str, str] = {},
    ) -> None:
        self.process = subprocess.Popen(
            [*command, str(domain)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env={**os.environ, **environment},
        )
        self.messages: dict[str, list[Any]] = {}
        self._unread, self.ready = b"", False
        while not self.ready:
            assert self._read(DEADLINE_S)

    def say(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line.encode() + b"\n")

    def heard(self, topic: str, wait_s: float = 0.0) -> list[Any]:
        """Return all messages of a topic; wait for what comes first, but not longer."""
        while self._read(wait_s):
            wait_s = 0.0
        return self.messages.get(topic, [])

    def pause(self) -> None:
        """Let it hang; it does when this returns."""
        os.kill(self.process.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED)

    def go_on(self) -> None:
        os.kill(self.process.pid, signal.SIGCONT)

    def kill(self) -> None:
        self.process.kill()
        self._end()

    def end(self) -> None:
        """Leave the domain as a program does."""
        if self.process.poll() is None:
            assert self.process.stdin is not None
            self.process.stdin.close()
            self._end()

    def _end(self) -> None:
        self.process.wait(DEADLINE_S)
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()

    def _read(self, wait_s: float) -> bool:
        assert self.process.stdout is not None
        if not select.select([self.process.stdout], [], [], wait_s)[0]:
            return False
        data = os.read(self.process.stdout.fileno(), 65_536)
        *lines, self._unread = (self._unread + data).split(b"\n")
        for line in lines:
            found = json.loads(line)
            self.ready = self.ready or "ready" in found
            if "topic" in found:
                self.messages.setdefault(found["topic"], []).append(found["message"])
        return bool(data)


class Joined:
    """A system; `join` joins it, `until` runs it."""

    def __init__(self, stack: ExitStack, domain: int, table: Path) -> None:
        self.manager, self.domain = Manager(), domain
        self._stack, self._table = stack, table
        self._calls: CallQueue | None = None
        self._joined = ExitStack()
        stack.callback(self.leave)

    def join(self, table: str = "") -> None:
        path = None
        if table:
            self._table.write_text(table)
            path = self._table
        engines = EngineOptions(ros2=Ros2Options(self.domain, table=path))
        self._joined.enter_context(
            engines_joined(engines, self.manager, self._attach, lambda: None)
        )

    def leave(self) -> None:
        self._joined.close()
        self._calls = None

    def peer(self, *words: str) -> Peer:
        peer = Peer(self.domain, [sys.executable, str(PEER), *words])
        self._stack.callback(peer.end)
        return peer

    def step(self) -> None:
        """Run one period, and make the calls that others wait for."""
        if self._calls is not None:
            self._calls.serve(1_000)
        self.manager.run_for(PERIOD_US)

    def until(self, done: Callable[[], object]) -> None:
        """Run the system until something is so."""
        end_s = time.monotonic() + DEADLINE_S
        while not done():
            assert time.monotonic() < end_s
            self.step()

    def _attach(self, calls: CallQueue) -> None:
        self._calls = calls


@contextmanager
def joined_system(table: Path) -> Iterator[Joined]:
    with own_domain() as domain, ExitStack() as stack:
        yield Joined(stack, domain, table)


@contextmanager
def command(name: str, *words: str, **pipes: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command of ours; it ends with 0, and without a traceback."""
    program = f"from tickrig.commands import {name}; {name}()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words], stderr=subprocess.PIPE, bufsize=0, **pipes
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 0, said
    assert b"Traceback" not in said

"""omniNames on a loopback port of its own, which can be killed, stopped and started again."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

DEADLINE_S = 30.0
"""Far more than anything here takes."""


def program() -> Path:
    """Return the name server itself: its command is a wrapper with a child."""
    import jeteve_omniorb  # noqa: PLC0415 - an extra

    return Path(jeteve_omniorb.__path__[0], "bin", "omniNames")


class OmniNames:
    """A name server in a process of its own.

    Args:
        folder: where it keeps its names.
    """

    def __init__(self, folder: Path) -> None:
        self.port, self._folder = free_port(), folder
        self._process: subprocess.Popen[str] | None = None

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start, without a name; it is there when this returns."""
        for file in self._folder.glob("omninames*"):
            file.unlink()
        where = ("-start", str(self.port), "-ORBendPoint", f"giop:tcp:{self.address}")
        command = (program(), *where, "-datadir", self._folder, "-errlog", "/dev/stderr")
        self._process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self._process.stderr is not None
        told = []
        for line in self._process.stderr:
            told.append(line)
            if "Checkpointing completed" in line:
                return
        raise AssertionError("".join(told))

    def pause(self) -> None:
        """Let it hang; it does when this returns."""
        assert self._process is not None
        self._signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self._process.pid, os.WSTOPPED)

    @property
    def hangs(self) -> bool:
        """Whether it is stopped now."""
        assert self._process is not None
        state = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()[0]
        return state == "T"

    def resume(self) -> None:
        """Let it go on."""
        self._signal(signal.SIGCONT)

    def kill(self) -> None:
        """End it as a power cut does."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _signal(self, number: int) -> None:
        assert self._process is not None
        os.kill(self._process.pid, number)


def eventually(condition: Callable[[], bool], what: str) -> None:
    """Wait until something is so; it is looked at again and again."""
    end_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end_s, what
        os.sched_yield()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port

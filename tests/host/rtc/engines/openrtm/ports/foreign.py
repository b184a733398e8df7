"""A system of ours, and foreign components in processes of their own, which die, hang and lie."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from tests.host.rtc.chain import PERIOD_US, make_manager
from tickrig.host.rtc import RtComponent
from tickrig.host.rtc.engines.openrtm.orb import Orb, nvlist
from tickrig.host.rtc.engines.openrtm.port_service import ComponentPorts, SystemPorts
from tickrig.host.rtc.engines.openrtm.stubs import DATA_TYPES, IDL, compile_idl, stubs
from tickrig.host.rtc.system.call_queue import CallQueue

R = TypeVar("R")

DEADLINE_S = 30.0
"""Far more than anything here takes."""

PROGRAM = Path(__file__).with_name("peer")


def compile_foreign(folder: Path) -> Path:
    """Compile our IDL for peers, with the data types."""
    names = ("SDOPackage.idl", "RTC.idl", "DataPort.idl", "RefHard.idl", DATA_TYPES)
    compile_idl([IDL / name for name in names], folder, "foreign")
    return folder


class Peer:
    """A foreign component with the ports `out` and `in` of TimedLong.

    Args:
        folder: of its stubs.
        port: where it listens; with one its references are the same after a restart.
        name_server: where it is bound, as `peer.host_cxt/Peer0.rtc`.
    """

    def __init__(self, folder: Path, port: int = 0, name_server: str = "") -> None:
        self._words = [str(folder), str(port or ""), name_server]
        self.start()

    def start(self) -> None:
        words = [sys.executable, str(PROGRAM), *self._words]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)
        assert self._process.stdout is not None
        self.iors: Mapping[str, str] = json.loads(self._process.stdout.readline())

    def ask(self, *words: object) -> Any:
        """Return what it answers; the system is not run meanwhile."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(" ".join(map(str, words)) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def pause(self) -> None:
        """Let it hang; it does when this returns."""
        os.kill(self._process.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, self._process.pid, os.WSTOPPED)

    def resume(self) -> None:
        os.kill(self._process.pid, signal.SIGCONT)

    def kill(self) -> None:
        self._process.kill()
        self._process.communicate()


class Served:
    """A system of ours whose ports peers see, run by the thread of the test."""

    def __init__(self, orb: Orb) -> None:
        self.orb, self.manager, self.calls = orb, make_manager(), CallQueue()
        self.ports = SystemPorts(orb, self.calls, self.manager)
        self.served: dict[str, ComponentPorts] = {}
        self._pool = ThreadPoolExecutor()

    @property
    def console_in(self) -> Any:
        return self.manager.find("ConsoleIn0")

    @property
    def console_out(self) -> Any:
        return self.manager.find("ConsoleOut0")

    @property
    def numbers(self) -> list[int]:
        """What arrived at ConsoleOut0."""
        return [value.data for value in self.console_out.received]

    def create(self, type_name: str) -> Any:
        """Create a component, Active."""
        component = self.manager.create(type_name)
        self.manager.activate(component.instance_name)
        return self.serve(component)

    def serve(self, component: RtComponent) -> Any:
        self.served[component.instance_name] = ComponentPorts(self.ports, component, None)
        return component

    def service(self, name: str) -> Any:
        """Return the PortService of a port."""
        return self.ports.references[self.manager.port(name)]

    def ior(self, name: str) -> str:
        return self.orb.text(self.service(name))

    def reference(self, ior: str) -> Any:
        return self.orb.reference(ior)._narrow(stubs().rtc.PortService)

    def profile(self, *ports: Any, connector_id: str = "", **values: str) -> Any:
        """Return a ConnectorProfile; keys are written with `_` for each dot behind `dataport`."""
        keys = {key.replace("__", "."): text for key, text in values.items()}
        return stubs().rtc.ConnectorProfile("", connector_id, list(ports), nvlist(keys))

    def connect(self, *ports: Any, connector_id: str = "", **values: str) -> tuple[str, Any]:
        """Connect as a tool does: in a thread of its own, while the system runs."""
        profile = self.profile(*ports, connector_id=connector_id, **values)
        code, profile = self.do(lambda: ports[0].connect(profile))
        return str(code), profile

    def do(self, action: Callable[[], R]) -> R:
        """Do something in another thread while the system runs."""
        future = self._pool.submit(action)
        self.until(future.done)
        return future.result()

    def step(self) -> None:
        self.calls.serve(1_000)
        self.manager.run_for(PERIOD_US)

    def until(self, done: Callable[[], object]) -> None:
        """Run the system until something is so."""
        end_s = time.monotonic() + DEADLINE_S
        while not done():
            assert time.monotonic() < end_s
            self.step()

    def close(self) -> None:
        self.ports.close()
        self.calls.close()
        self._pool.shutdown()

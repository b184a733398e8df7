"""A system with an engine, run by a thread; the test is its peer, by references alone."""

from __future__ import annotations

import threading
from typing import Any

from omniORB import CORBA

from tests.host.rtc.engines.openrtm.name_server import DEADLINE_S, free_port
from tests.host.rtc.spy import Spy
from tickrig.host.cli.engine_options import Endpoint, OpenRtmOptions, parse_endpoint
from tickrig.host.control.clock import ServingClock
from tickrig.host.rtc.components import ConfigSample, ConsoleOut
from tickrig.host.rtc.engines.openrtm.engine import openrtm_joined
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.schedule import RealTime

RATE_HZ = 100.0


class ServedSystem:
    """A system with Spy0 and ConfigSample0.

    Args:
        name_server: its address; without one there is nobody.
        fixed: see `OpenRtmEngine`.

    Attributes:
        spy: the component itself; a test looks at it, and calls its reference.
        manager: reference of the manager.
        idl: the stubs.
    """

    def __init__(self, name_server: str = "", *, fixed: bool = False) -> None:
        self.idl, self._port, self._fixed = stubs(), free_port(), fixed
        self._name_server = parse_endpoint(name_server) if name_server else Endpoint(port=1)
        self._rtcs, self._clock = Manager(), ServingClock()
        self._rtcs.register(ConsoleOut)
        self.spy = self._rtcs.add(Spy(), RATE_HZ)
        self._rtcs.add(ConfigSample("ConfigSample0"), RATE_HZ)
        self._runner = RealTime(self._rtcs, self._clock)
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self._ready.wait(DEADLINE_S)
        orb = CORBA.ORB_init([], CORBA.ORB_ID)
        reference = orb.string_to_object(f"corbaloc::127.0.0.1:{self._port}/manager")
        self.manager: Any = reference._narrow(self.idl.rtm.Manager)

    def _run(self) -> None:
        """Be the manager's thread: the engine comes and goes in it, too."""
        calls = CallQueue()
        self._clock.serve = calls.serve
        options = OpenRtmOptions(self._name_server, Endpoint(port=self._port))
        stop = self._runner.stop
        with openrtm_joined(options, self._rtcs, calls, stop, fixed=self._fixed):
            self._ready.set()
            self._runner.run()

    def component(self, name: str = "Spy0") -> Any:
        """Return the reference of a component."""
        found = {one.get_sdo_id(): one for one in self.manager.get_components()}
        return found[name]

    def context(self, name: str = "Spy0") -> Any:
        """Return the reference of its own execution context."""
        (context,) = self.component(name).get_owned_contexts()
        return context._narrow(self.idl.rtc.ExecutionContextService)

    def join(self) -> None:
        """Wait until it has ended."""
        self._thread.join()

    def close(self) -> None:
        """End it."""
        self._runner.stop()
        self._thread.join()

"""The experiments of the paper with two `rtc-lite-emu` on ptys, against the wall clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing

import pytest

from tests.host.rtc.lite.experiment import ALL, JOINTS
from tickrig.emulators.bench.child import Child, running
from tickrig.host.control.client import ControlClient
from tickrig.host.control.clock import RealClock
from tickrig.host.links.link import ReopeningLink
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import ExecutionContext, Manager
from tickrig.host.rtc.components import ConsoleIn, ConsoleOut
from tickrig.host.rtc.lite import ProxyEvent, ProxySettings, attach
from tickrig.host.rtc.system.schedule import RealTime

EMULATOR = "tickrig.emulators.rtc_lite.cli"
DEADLINE_S = 10.0
EARLY_US = 100_000
"""The clocks of two processes, and their ticks."""

LATE_US = 5_000_000
"""A machine that has much else to do."""


def run_until(runner: RealTime, done: Callable[[], bool]) -> None:
    """Run until something is so."""
    deadline_s = time.monotonic() + DEADLINE_S
    while not done():
        assert time.monotonic() < deadline_s
        runner.step()


class Live:
    """Experiment 1 on two terminals."""

    def __init__(self, stack: ExitStack) -> None:
        self.manager, context = Manager(), ExecutionContext(10.0)
        self.source = self.manager.add(ConsoleIn("ConsoleIn0"), context=context)
        self.events: list[ProxyEvent] = []
        self.nodes: list[Child] = []
        for node, name in (("lite-a", "LiteA"), ("lite-b", "LiteB")):
            child = stack.enter_context(running(EMULATOR, "--node", node))
            link = stack.enter_context(closing(SerialLink(str(child.link), 57_600)))
            attach(self.manager, link, name, context=context, listener=self.events.append)
            self.nodes.append(child)
        self.sink = self.manager.add(ConsoleOut("ConsoleOut0"), context=context)
        context.start()
        for joint in JOINTS:
            self.manager.connect(*joint)
        self._runner = RealTime(self.manager, RealClock())

    def await_(self, done: Callable[[], bool]) -> None:
        run_until(self._runner, done)

    def activate(self) -> None:
        self.manager.activate(*ALL)
        self.await_(lambda: set(self.states().values()) == {"ACTIVE"})

    def states(self) -> dict[str, str]:
        names = [component.instance_name for component in self.manager.components]
        return {name: self.manager.state_of(name).name for name in names}

    def cut(self, at: int) -> int:
        """Cut the power of a node, and return when."""
        with ControlClient(self.nodes[at].control) as hand:
            hand.request("fault", spec="power_cut")
        return time.monotonic_ns() // 1_000

    def await_event(self, kind: str) -> int:
        """Run until something is told, and return at which time it happened."""
        self.await_(lambda: any(event.kind == kind for event in self.events))
        return next(event.at_us for event in self.events if event.kind == kind)


@pytest.fixture
def live() -> Iterator[Live]:
    with ExitStack() as stack:
        yield Live(stack)


@pytest.mark.realtime
def test_t1_and_t2_on_two_ptys(live: Live) -> None:
    live.activate()
    live.source.enter(1, -5, 2_147_483_647)
    live.await_(lambda: len(live.sink.received) == 3)
    assert [value.data for value in live.sink.received] == [1, -5, 2_147_483_647]
    cut_us = live.cut(0)
    fatal_us = live.await_event("FatalError")
    assert 500_000 - EARLY_US <= fatal_us - cut_us <= 600_000 + LATE_US
    removed_us = live.await_event("Removed")
    assert 1_000_000 <= removed_us - fatal_us <= 1_000_000 + LATE_US
    assert live.states() == {name: "ACTIVE" for name in ALL if name != "LiteA0"}
    assert [profile.ports for profile in live.manager.connectors] == [JOINTS[2]]


@pytest.mark.realtime
def test_t3_on_two_ptys(live: Live) -> None:
    cut_us = live.cut(1)
    fatal_us = live.await_event("FatalError")
    assert fatal_us - cut_us <= 1_400_000 + LATE_US
    assert live.events[0].instance_name == "LiteB0"


@pytest.mark.realtime
def test_an_emulator_that_is_started_again_is_found_again() -> None:
    settings = ProxySettings(
        ping_period_us=100_000, linger_us=0, rediscover=True, search_period_us=100_000
    )
    manager, events, paths = Manager(), list[ProxyEvent](), list[str]()
    runner = RealTime(manager, RealClock())
    with running(EMULATOR) as child:
        paths.append(str(child.link))
        link = ReopeningLink(lambda: SerialLink(paths[-1], 57_600))
        attach(manager, link, "Echo", settings, listener=events.append)
    with closing(link), running(EMULATOR) as child:
        run_until(runner, lambda: manager.components == ())
        paths.append(str(child.link))
        run_until(runner, lambda: manager.components != ())
    assert [event.kind.value for event in events] == ["FatalError", "Removed", "Rediscovered"]

"""Proxies and emulated nodes on one rig in virtual time."""

from __future__ import annotations

from collections.abc import Callable

from tests.host.spy_link import SpyLink
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rtc_lite.line import LINE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rtc import ExecutionContext, Manager
from tickrig.host.rtc.lite import ProxyEvent, ProxySettings, RtcLiteProxy, attach

TICK_US = 10_000
PERIOD_US = 10 * TICK_US
BAUD = 57_600


class Bench:
    """A system whose time is that of a rig with nodes.

    Attributes:
        nodes: the devices.
        lines: their ends of the serial lines, where faults are armed.
        links: the hosts' ends; they keep what passes.
        events: what the proxies told.
    """

    def __init__(
        self,
        *kinds: Callable[[], LiteComponent],
        config: LiteConfig | None = None,
        baud: int = BAUD,
    ) -> None:
        lines = [SerialLine(baud) for _ in kinds]
        self.nodes = [RtcLiteNode(kind, config or LiteConfig()) for kind in kinds]
        self.lines = [FaultyPort(line.a, LINE_FAULTS) for line in lines]
        self.rig = Rig(*map(Station, self.nodes, self.lines))
        self.links = [SpyLink(SimLink(self.rig, line.b)) for line in lines]
        self.manager = Manager()
        self.context = ExecutionContext(1_000_000 / PERIOD_US)
        self.events: list[ProxyEvent] = []

    def attach(self, at: int, name: str, settings: ProxySettings | None = None) -> RtcLiteProxy:
        """Make a proxy for a node, in the context that all share."""
        return attach(
            self.manager,
            self.links[at],
            name,
            settings,
            context=self.context,
            listener=self.events.append,
        )

    def run_to(self, t_us: int) -> None:
        """Let rig and system go on together."""
        while (due_us := max(self.manager.due_us, self.rig.now_us)) <= t_us:
            self.rig.run_to(due_us)
            self.manager.tick(self.rig.now_us)
        self.rig.run_to(max(t_us, self.rig.now_us))

    def run_for(self, duration_us: int) -> None:
        self.run_to(self.rig.now_us + duration_us)

    def announced(self) -> list[tuple[str, str]]:
        """Return what was told: which event, of which proxy."""
        return [(event.kind.value, event.instance_name) for event in self.events]

    def at_us(self, kind: str) -> int:
        """Return when something was told that was told once."""
        (at_us,) = [event.at_us for event in self.events if event.kind == kind]
        return at_us

    def states(self) -> dict[str, str]:
        """Return the state of each component."""
        names = [component.instance_name for component in self.manager.components]
        return {name: self.manager.state_of(name).name for name in names}

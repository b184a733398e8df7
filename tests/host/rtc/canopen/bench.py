"""A server on a rig with our slaves, in virtual time."""

from __future__ import annotations

from pathlib import Path

from tests.emulators.can.can_bench import Log
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.definition import SystemDefinition
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.events import ServerEvent, ServerEventType
from tickrig.host.rtc.canopen.proxy import ProxyRtc
from tickrig.host.rtc.canopen.serve import read_files, serve
from tickrig.host.rtc.canopen.server import RtcCanopenServer

EXAMPLES = Path(__file__).parents[4] / "examples"
EDS = EXAMPLES / "eds"
SYSTEMS = EXAMPLES / "rtc_canopen"

PALETTE_AND_MOTOR = """
nodes:
- {id: 16, name: Palette0, eds: f-palette.eds, role: device}
- {id: 32, name: Motor0, eds: motor-core-unit.eds, role: device}
"""


def node(wire: CanWire, node_id: int, model: str) -> Node:
    made = MODELS[model]
    slave = make_slave(made.dictionary(), node_id, application=made.application)
    return Node(str(node_id), slave, wire)


class Bench:
    """A bus with nodes, and a server.

    Args:
        text: the System Definition.
        models: model by node-ID; a second node of the same ID as `id + 1000`.
        folder: of the EDS files.
    """

    def __init__(
        self,
        text: str = PALETTE_AND_MOTOR,
        models: dict[int, str] | None = None,
        folder: Path = EDS,
    ) -> None:
        models = models or {16: "f-palette", 32: "motor-core-unit"}
        self.wire = CanWire()
        self.log = Log(self.wire)
        self.devices = {n: node(self.wire, n % 1000, model) for n, model in models.items()}
        self.rig = Rig(*(Station(device, device.port) for device in self.devices.values()))
        self.definition: SystemDefinition = parse_definition(text)
        self.server = RtcCanopenServer(self.definition, read_files(self.definition, folder))
        self.end = self.wire.end()
        self.link = CanHost(self.rig, self.end)
        self.other = CanHost(self.rig, self.wire.end())
        self.rig.run_for(1_000)  # so that no question meets a node in its first tick

    @property
    def now_us(self) -> int:
        return self.rig.now_us

    def run_ms(self, duration_ms: float) -> None:
        serve(self.server, self.link, self.now_us + round(1_000 * duration_ms))

    def run_until(
        self, kind: ServerEventType, node_id: int = 0, within_ms: int = 5_000
    ) -> ServerEvent:
        """Run until an event happens, and return it."""
        found: list[ServerEvent] = []

        def hear(event: ServerEvent) -> None:
            if event.kind is kind and event.node in (node_id or event.node, 0):
                found.append(event)

        self.server.log.listeners.append(hear)
        serve(self.server, self.link, self.now_us + 1_000 * within_ms, lambda: bool(found))
        self.server.log.listeners.remove(hear)
        assert found, f"no {kind} of node {node_id}: {self.events()}"
        return found[0]

    def boot(self) -> None:
        for node_id in self.server.nodes:
            if self.proxy(node_id) is None:
                self.run_until(ServerEventType.PROXY_MADE, node_id)

    def activate(self, *node_ids: int) -> None:
        for node_id in node_ids or tuple(self.server.nodes):
            self.server.manager.activate(self.server.nodes[node_id].entry.name)
        self.run_ms(400)

    def proxy(self, node_id: int) -> ProxyRtc | None:
        return self.server.nodes[node_id].proxy

    def state(self, node_id: int) -> LifeCycleState | None:
        proxy = self.proxy(node_id)
        return proxy.state if proxy else None

    def events(self, *kinds: ServerEventType) -> list[str]:
        return [
            f"{event.kind} {event.node} {event.text}".strip()
            for event in self.server.log.events
            if not kinds or event.kind in kinds
        ]

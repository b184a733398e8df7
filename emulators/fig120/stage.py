"""Where the demonstration is played: in virtual time, or on a bus of python-can."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Final, Protocol

import canopen

from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.bench.child import running
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.models import MODELS, Model
from tickrig.emulators.canopen.node.node import Node
from tickrig.emulators.canopen.node.nodes import Nodes
from tickrig.emulators.fig120.set_up import MOTOR, PALETTE, PATIENCE_S
from tickrig.emulators.rig.emulated import read_signal
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.cli.refused import Refused
from tickrig.host.control.client import ControlClient
from tickrig.host.text.values import Setting

BIT_RATE: Final = 1_000_000
CAST: Final = {PALETTE: "f-palette", MOTOR: "motor-core-unit"}
"""Which model has which node-ID."""

WITHIN_A_PROCESS: Final = ("virtual", "tickrig")

EMULATOR: Final = "tickrig.emulators.canopen.cli"


class Stage(Protocol):
    """Both devices, and the bus that the master is on at first.

    Attributes:
        network: the master.
        step_us: how often it can be looked at.
    """

    network: canopen.Network
    step_us: int

    @property
    def now_us(self) -> int:
        """Time on the stage."""
        ...

    def run_to(self, at_us: int, /) -> None:
        """Let time pass."""

    def get(self, name: str, /) -> Setting:
        """Look at a thing of a node, as `32/angle_deg`."""
        ...

    def set(self, name: str, value: Setting, /) -> None:
        """Set a signal of a node, as `16/ai1_v`."""


class VirtualStage:
    """A rig in virtual time.

    Attributes:
        wire: the bus.
    """

    step_us = 1_000

    def __init__(self) -> None:
        self.wire = wire = CanWire(BIT_RATE)
        nodes = [_node(node_id, MODELS[name], wire) for node_id, name in CAST.items()]
        self._nodes = Nodes(nodes)
        self._rig = Rig(*(Station(node, node.port) for node in nodes))
        self.network: canopen.Network = SimNetwork(self._rig, wire.end())
        self.run_to(10_000)  # both have booted

    @property
    def now_us(self) -> int:
        """Time of the rig."""
        return self._rig.now_us

    def run_to(self, at_us: int) -> None:
        """Run the rig."""
        self._rig.run_to(at_us)

    def get(self, name: str) -> Setting:
        """Return the value of a signal of a node."""
        return read_signal(self._nodes, name)

    def set(self, name: str, value: Setting) -> None:
        """Set a signal of a node."""
        self._nodes.inputs.set(name, value)


class BusStage:
    """An emulator in a process of its own on a bus of python-can, in real time."""

    step_us = 20_000

    def __init__(self, network: canopen.Network, hand: ControlClient) -> None:
        self.network, self._hand = network, hand

    @property
    def now_us(self) -> int:
        """Time of the machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def run_to(self, at_us: int) -> None:
        """Wait."""
        time.sleep(max(0, at_us - self.now_us) / 1e6)

    def get(self, name: str) -> Setting:
        """Ask the emulator."""
        values = self._hand.request("get", names=[name])["values"]
        assert isinstance(values, dict)
        value: Setting = values[name]
        return value

    def set(self, name: str, value: Setting) -> None:
        """Tell the emulator."""
        self._hand.request("set", name=name, value=value)


@contextmanager
def bus_stage(options: BusOptions) -> Iterator[Stage]:
    """Start the emulator on a bus, and a master beside it.

    Raises:
        Refused: the bus cannot be used.
        RuntimeError: the emulator does not start.
    """
    if options.interface in WITHIN_A_PROCESS:
        raise Refused(f"{options.interface} is inside one process, and the nodes run in another")
    nodes = [f"--node={node_id}={model}" for node_id, model in CAST.items()]
    with ExitStack() as stack:
        child = stack.enter_context(running(EMULATOR, *nodes, *options.arguments(), linked=False))
        hand = stack.enter_context(ControlClient(child.control, PATIENCE_S))
        bus, *_ = open_raw(options)
        stack.callback(bus.shutdown)
        network = canopen.Network(bus)
        stack.callback(network.disconnect)
        yield BusStage(network.connect(), hand)


def _node(node_id: int, model: Model, wire: CanWire) -> Node:
    slave = make_slave(model.dictionary(), node_id, application=model.application)
    return Node(str(node_id), slave, wire)

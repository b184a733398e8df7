"""DeviceRTC: a component at work in a CANopen slave."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.nonvolatile import Nonvolatile
from tickrig.device.canopen.core.slave import CanopenSlave, ServiceMaker
from tickrig.device.canopen.device_rtc.component import CanopenComponent
from tickrig.device.canopen.device_rtc.life_cycle import CanopenLifeCycle
from tickrig.device.canopen.device_rtc.terminals import SHUT_DOWN, inputs_of, outputs_of, text_of
from tickrig.device.canopen.pdo.pdo_producer import PdoProducer
from tickrig.device.canopen.stack import make_slave
from tickrig.device.component import Timer
from tickrig.device.physical import OutputSignal
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.rtc_canopen.objects import object_table


class DeviceRtc(Application):
    """Runs a component with the NMT state of its node (NEDO report, 3.4.43.3, Fig. 110).

    Callbacks take no time. What the state does at the component's rate begins one
    period after the state was entered.

    Not emulated: service ports, configuration sets, several components on one node.

    Args:
        node: the slave; its dictionary is that of the component.
        slot: its place in the order of a tick.
        kind: the component.

    Attributes:
        life: the life cycle, with the component.

    Raises:
        ValueError: physical inputs that cannot be.
    """

    def __init__(self, node: CanopenSlave, slot: int, kind: type[CanopenComponent]) -> None:
        super().__init__(node, slot)
        self._kind, self._placed = kind, kind.profile().placed()
        self.has_inputs(inputs_of(kind))
        self.life = CanopenLifeCycle(node, self._make)
        self.outputs: Mapping[str, OutputSignal] = outputs_of(self.life.component)
        self._timer = Timer(kind.rate_hz)
        node.boots, node.admits = self.life.boots, self.life.admits
        node.entered = self._moved

    def read(self, name: str) -> float | str:
        """Look at an output, as it was left by the latest tick.

        Args:
            name: one of `outputs`.

        Returns:
            Its value.

        Raises:
            KeyError: there is none of that name.
        """
        return text_of(self.life, name)

    def power_on(self) -> None:
        """Begin with a new component."""
        self.life.create()

    def start(self) -> None:
        """Do nothing until the node has booted."""
        self._timer.stop()

    def on_execute(self, now_us: int) -> None:
        """Run what the state of the component does, if a period has ended."""
        if self.inputs[SHUT_DOWN]:
            self.life.finalize()
        if self._timer.elapsed(now_us):
            self.life.run()
        self.schedule(self._timer.due_us)

    def _moved(self, old: NmtState, new: NmtState) -> None:
        """Let the new state count its periods from now on, then run the callbacks."""
        self._timer.stop()
        if self.life.activity:
            self._timer.start(self.node.now_us)
        self.request()
        self.life.moved(old, new)

    def _make(self) -> CanopenComponent:
        """Make a component and join it to the dictionary."""
        component = self._kind()
        component.inputs = self.inputs
        for place in self._placed:
            entries = [self.node.dictionary[place.index, sub] for sub in place.subs]
            component.ports[place.profile.name].join(entries, self._event)
        return component

    def _event(self, entry: Entry) -> None:
        PdoProducer.of(self.node).request_for(entry)


def make_dictionary(kind: type[CanopenComponent]) -> Dictionary:
    """Make the objects of a component; ValueError if its profile cannot be."""
    table = object_table(kind.profile())
    return Dictionary(table, table.objects)


def application_of(kind: type[CanopenComponent]) -> ServiceMaker:
    """Return what makes the application of a component."""
    return partial(DeviceRtc, kind=kind)


def make_device_rtc(
    kind: type[CanopenComponent], node_id: int, nonvolatile: Nonvolatile | None = None
) -> CanopenSlave:
    """Make a slave that is a DeviceRTC.

    Args:
        kind: the component.
        node_id: 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: what it kept from an earlier life.

    Raises:
        ValueError: a component or a node-ID that cannot be.
    """
    return make_slave(make_dictionary(kind), node_id, nonvolatile, application_of(kind))

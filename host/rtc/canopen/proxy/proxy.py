"""ProxyRTC: a CANopen device as an RT component (NEDO report, Figs. 108 and 109)."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final

from tickrig.host.rtc.canopen.definition.definition import NodeEntry
from tickrig.host.rtc.canopen.proxy.pdo_layout import PdoLayout
from tickrig.host.rtc.canopen.proxy.pdo_ports import PdoSink, PdoSource
from tickrig.host.rtc.canopen.proxy.sdo_ports import SdoPortLayout, SdoSink, SdoSource
from tickrig.host.rtc.component import ModuleSpec, RtComponent
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.states import LifeCycleState, ReturnCode
from tickrig.wire.rtc_canopen.profile import PortDirection

OK: Final = ReturnCode.RTC_OK


class ProxyRequest(Enum):
    """What the RT side asked for and the bus has not been told yet."""

    NOTHING = auto()
    ACTIVATE = auto()
    DEACTIVATE = auto()
    ABORT = auto()
    RESET = auto()


NOTHING: Final = ProxyRequest.NOTHING
"""Looked up once: it takes 0.1 us, and each proxy is asked in each period."""


class ProxyRtc(RtComponent):
    """An ordinary RT component that stands for a device.

    Its callbacks note what they ask for; the server says it on the bus after the
    period. A reset is refused by on_reset until the device has booted anew, so
    Error lasts until then.

    Not emulated: a CANopen node of its own on the bus (`visible_proxies` of K1).

    Args:
        entry: its node.
        layouts: PDOs of the device.
        sdo_layouts: objects of the device that have ports by SDO.

    Attributes:
        sources: TPDOs of the device, whose data go to OutPorts.
        sinks: RPDOs of the device, which take data from InPorts.
        sdo_sources: objects of the device whose values go to OutPorts.
        sdo_sinks: objects of the device that take values from InPorts.
        requested: what the callbacks asked for.
        passing: between on_activated and on_deactivated: data of the device pass.
        confirmed: the device has reported that it is Operational: data for it pass as well.
        ready: the device is fit to leave Error.
    """

    spec = ModuleSpec("ProxyRTC", "A CANopen device", category="RTC-CANopen")

    def __init__(
        self,
        entry: NodeEntry,
        layouts: tuple[PdoLayout, ...],
        sdo_layouts: tuple[SdoPortLayout, ...] = (),
    ) -> None:
        super().__init__(entry.name)
        self.requested, self.ready = NOTHING, False
        self.passing = self.confirmed = False
        named = [(layout, entry.ports.get(layout.name, layout.name)) for layout in layouts]
        fit = [(layout, name) for layout, name in named if layout.fields and not layout.unknown]
        self.sources = tuple(PdoSource(layout, name) for layout, name in fit if layout.sends)
        self.sinks = tuple(PdoSink(layout, name) for layout, name in fit if not layout.sends)
        for source in self.sources:
            for out in source.ports:
                self.add_port(out)
        for sink in self.sinks:
            for in_ in sink.ports:
                self.add_port(in_)
        outs = [layout for layout in sdo_layouts if layout.direction is PortDirection.OUT]
        self.sdo_sources = tuple(map(SdoSource, outs))
        self.sdo_sinks = tuple(SdoSink(layout) for layout in sdo_layouts if layout not in outs)
        for read in self.sdo_sources:
            self.add_port(read.port)
        for written in self.sdo_sinks:
            self.add_port(written.port)

    @property
    def state(self) -> LifeCycleState:
        """Its state in its execution context; Created if it has none."""
        return self.contexts[0].state_of(self) if self.contexts else LifeCycleState.CREATED

    def take_request(self) -> ProxyRequest:
        """Take what was asked for."""
        requested, self.requested = self.requested, NOTHING
        return requested

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Let data pass; ask for Operational."""
        self.requested, self.passing, self.confirmed = ProxyRequest.ACTIVATE, True, False
        for sink in self.sinks:
            sink.clear()
        for written in self.sdo_sinks:
            written.clear()
        return OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Let no data pass; ask for Pre-operational."""
        self.requested, self.passing, self.confirmed = ProxyRequest.DEACTIVATE, False, False
        return OK

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        """Ask for Stopped, which takes the place of what on_deactivated asked for."""
        self.requested, self.ready = ProxyRequest.ABORT, False
        return OK

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """Ask for a reset of the device; RTC_OK once it has booted."""
        if self.ready:
            return OK
        self.requested = ProxyRequest.RESET
        return ReturnCode.RTC_ERROR

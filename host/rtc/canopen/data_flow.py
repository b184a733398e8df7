"""Data between the bus and ports of proxies, by PDO and by SDO."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

from tickrig.host.canopen.dialogue import Failure, QueuedScript, Script
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.rtc.canopen.events import Notify, ServerEventType
from tickrig.host.rtc.canopen.operations import kind_of
from tickrig.host.rtc.canopen.proxy import PdoSink, PdoSource, ProxyRtc, SdoSink, SdoSource
from tickrig.host.rtc.canopen.served_node import NodePhase, ServedNode
from tickrig.host.rtc.states import ReturnCode
from tickrig.wire.can import CanFrame
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Time

_Send = Callable[[int, bytes], None]


class PdoDataFlow:
    """Transfer of values between the bus and ports by PDO.

    Received TPDOs are written to OutPorts of the proxies, and values at InPorts are sent as RPDOs.
    Values are transferred while the proxy is Active. RPDOs are sent only when the device is also
    Operational.

    Args:
        nodes: nodes by node-ID.
        send: function that sends a data frame. Its arguments are CAN-ID and data.
        notify: function that is called with events.
    """

    def __init__(self, nodes: Mapping[int, ServedNode], send: _Send, notify: Notify) -> None:
        self._nodes, self._send, self._notify = nodes, send, notify
        self._sources: dict[int, tuple[tuple[ServedNode, PdoSource], ...]] = {}
        self._connected: tuple[tuple[ServedNode, PdoSink], ...] = ()
        self._written = set[int]()  # places in _connected: 126 sinks are not looked at each tick

    def route(self) -> None:
        """Rebuild two tables: received PDOs with their OutPorts, and InPorts with connectors."""
        self._sources = {}
        for node in self._nodes.values():
            for source in node.proxy.sources if node.proxy else ():
                cob_id = source.layout.cob_id
                self._sources[cob_id] = (*self._sources.get(cob_id, ()), (node, source))
        self._connected = tuple(
            (node, sink)
            for node, sink in self._sinks()
            if any(port.connectors for port in sink.ports)
        )
        self._written = set(range(len(self._connected)))
        for place, (_, sink) in enumerate(self._connected):
            for port in sink.ports:
                for connector in port.connectors:
                    connector.buffer.on_write = partial(self._written.add, place)

    def watch(self, node: ServedNode) -> None:
        """Call `route` now, and whenever an InPort of a new proxy gets or loses a connector.

        The method `route` rebuilds the tables of PDOs and ports.
        """
        for sink in node.proxy.sinks if node.proxy else ():
            for port in sink.ports:
                port.on_connect.append(lambda _: self.route())
                port.on_disconnect.append(lambda _: self.route())
        self.route()

    def receive(self, now_us: int, frame: CanFrame) -> bool:
        """Write the values of a received PDO to the OutPorts of its proxy.

        Return False if the frame is not a PDO of a proxy.
        """
        routes = self._sources.get(frame.can_id, ())
        for node, source in routes:
            if len(frame.data) < source.size:
                text = f"{source.layout.name}: {len(frame.data)} of {source.size} bytes"
                self._notify(ServerEventType.PDO_TOO_SHORT, node.entry.id, text)
            elif node.proxy is not None and node.proxy.passing:
                source.receive(now_us, frame.data)
        return bool(routes)

    def send_values(self) -> None:
        """Send the values of InPorts. Values that cannot be sent now are dropped."""
        if not self._written:
            return
        connected, places = self._connected, sorted(self._written)
        self._written.clear()
        for node, sink in map(connected.__getitem__, places):
            for port, value in sink.take():
                if self._send_value(node, sink, port, value) is ReturnCode.BAD_PARAMETER:
                    text = f"{node.entry.name}.{port}: {value}"
                    self._notify(ServerEventType.VALUE_REFUSED, node.entry.id, text)

    def put(self, name: str, value: Struct) -> ReturnCode:
        """Send a value to a port without using a connector; see `RtcCanopenServer.put`."""
        for node, sink in self._sinks():
            for port in sink.ports:
                if port.full_name == name:
                    return self._send_value(node, sink, port.name, value)
        return ReturnCode.BAD_PARAMETER

    def _sinks(self) -> Iterator[tuple[ServedNode, PdoSink]]:
        for node in self._nodes.values():
            for sink in node.proxy.sinks if node.proxy else ():
                yield node, sink

    def _send_value(self, node: ServedNode, sink: PdoSink, port: str, value: Struct) -> ReturnCode:
        if node.proxy is None or not node.proxy.confirmed or sink.linked:
            return ReturnCode.PRECONDITION_NOT_MET
        try:
            data = sink.encode(port, value)
        except (ValueError, TypeError):
            return ReturnCode.BAD_PARAMETER
        self._send(sink.layout.cob_id, data)
        return ReturnCode.RTC_OK


class SdoDataFlow:
    """Transfer of values by SDO between the ports of proxies and the objects of devices.

    A proxy is an RT component that represents a device. For an OutPort of the proxy, an object of
    the device is read. For an InPort, an object is written. Values are transferred while the proxy
    is Active and its device is Operational.

    In each period of the server, at most one value is transferred per port. If the transfers of a
    proxy take longer than a period, the proxy begins no new transfers until they have ended.

    Args:
        nodes: nodes by node-ID.
        notify: function that is called with events.
    """

    def __init__(self, nodes: Mapping[int, ServedNode], notify: Notify) -> None:
        self._nodes, self._notify = nodes, notify
        self._busy = set[int]()  # node-IDs
        self._failed = set[tuple[int, str]]()  # node-ID and port that were reported

    def exchange(self, now_us: int) -> None:
        """Begin the SDO transfers of a period."""
        for node_id, node in self._nodes.items():
            proxy = node.proxy
            if proxy is None or not (proxy.sdo_sources or proxy.sdo_sinks):
                continue
            if not proxy.passing:
                self._failed = {at for at in self._failed if at[0] != node_id}
            fit = proxy.confirmed and proxy.passing and node.phase is NodePhase.READY
            if not fit or node_id in self._busy:
                continue
            for sink in proxy.sdo_sinks:
                self._take(node, sink)
            sinks = [sink for sink in proxy.sdo_sinks if sink.pending is not None]
            sources = [source for source in proxy.sdo_sources if source.port.connectors]
            if sinks or sources:
                self._begin(now_us, node, self._transfer(node, proxy, sinks, sources))

    def put(self, name: str, value: Struct) -> ReturnCode | None:
        """Write a value to an InPort directly. The device gets the value in the next period.

        Returns:
            RTC_OK if the value was accepted, BAD_PARAMETER if it does not fit the object,
            PRECONDITION_NOT_MET while the device has not reported Operational, or None if there is
            no such InPort.
        """
        for node in self._nodes.values():
            for sink in node.proxy.sdo_sinks if node.proxy else ():
                if sink.port.full_name == name:
                    if node.proxy is None or not node.proxy.confirmed:
                        return ReturnCode.PRECONDITION_NOT_MET
                    return self._set(sink, value)
        return None

    def _take(self, node: ServedNode, sink: SdoSink) -> None:
        value = sink.take()
        if value is not None and self._set(sink, value) is ReturnCode.BAD_PARAMETER:
            text = f"{node.entry.name}.{sink.port.name}: {value}"
            self._notify(ServerEventType.VALUE_REFUSED, node.entry.id, text)

    def _set(self, sink: SdoSink, value: Struct) -> ReturnCode:
        try:
            sink.pending = sink.layout.encode(value)
        except (ValueError, TypeError):
            return ReturnCode.BAD_PARAMETER
        return ReturnCode.RTC_OK

    def _begin(self, now_us: int, node: ServedNode, script: Script[None]) -> None:
        node_id = node.entry.id

        def end(_: object = None) -> None:
            self._busy.discard(node_id)

        def fail(failure: Failure) -> None:
            end()
            self._report(node, kind_of(failure), "", str(failure))

        self._busy.add(node_id)
        node.run(now_us, QueuedScript("ports", script, end, fail, end, moves=False))

    def _transfer(
        self, node: ServedNode, proxy: ProxyRtc, sinks: list[SdoSink], sources: list[SdoSource]
    ) -> Script[None]:
        """Write the objects, then read them.

        A refusal for one port does not delay the other ports.
        """
        for sink in sinks:
            elements, sink.pending = sink.pending or (), None
            yield from self._try(node, sink, sink.layout.write(elements))
        for source in sources:
            yield from self._try(node, source, self._read(node, proxy, source))

    def _read(self, node: ServedNode, proxy: ProxyRtc, source: SdoSource) -> Script[None]:
        elements = yield from source.layout.read()
        value = source.layout.decode(Time.from_us(node.operations.now_us), elements)
        if proxy.passing:
            source.port.write(value)

    def _try(
        self, node: ServedNode, port: SdoSource | SdoSink, script: Script[None]
    ) -> Script[None]:
        """Run the transfer of a port. If the transfer is refused, report this once."""
        name = port.layout.name
        try:
            yield from script
        except SdoAborted as error:
            self._report(node, ServerEventType.SDO_ABORTED, name, str(error))
        except FieldError as error:
            self._report(node, ServerEventType.VALUE_REFUSED, name, str(error))
        else:
            self._failed.discard((node.entry.id, name))

    def _report(self, node: ServedNode, kind: ServerEventType, port: str, why: str) -> None:
        """Report a port that does not work.

        The report is not repeated until the port works again.
        """
        at = node.entry.id, port
        if at not in self._failed:
            self._failed.add(at)
            name = f"{node.entry.name}.{port}" if port else node.entry.name
            self._notify(kind, node.entry.id, f"{name}: {why}")

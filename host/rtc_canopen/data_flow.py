"""Data between PDOs on the bus and ports of proxies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

from tickrig.host.rtc.states import ReturnCode
from tickrig.host.rtc_canopen.events import Notify, ServerEventType
from tickrig.host.rtc_canopen.node.served_node import ServedNode
from tickrig.host.rtc_canopen.proxy.pdo_ports import PdoSink, PdoSource
from tickrig.wire.can import CanFrame
from tickrig.wire.rtc_types.idl import Struct

Send = Callable[[int, bytes], None]


class PdoDataFlow:
    """Writes received PDOs to OutPorts, and sends what comes to InPorts.

    Data pass while the proxy is Active; for the device not before it is Operational.

    Args:
        nodes: by node-ID.
        send: takes CAN-ID and data.
        notify: takes events.
    """

    def __init__(self, nodes: Mapping[int, ServedNode], send: Send, notify: Notify) -> None:
        self._nodes, self._send, self._notify = nodes, send, notify
        self._sources: dict[int, tuple[tuple[ServedNode, PdoSource], ...]] = {}
        self._connected: tuple[tuple[ServedNode, PdoSink], ...] = ()
        self._written = set[int]()  # places in _connected: 126 sinks are not looked at each tick

    def route(self) -> None:
        """Collect anew which PDO goes to which OutPorts, and which InPorts have connectors."""
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
        """Collect anew whenever an InPort of a new proxy gets or loses a connector."""
        for sink in node.proxy.sinks if node.proxy else ():
            for port in sink.ports:
                port.on_connect.append(lambda _: self.route())
                port.on_disconnect.append(lambda _: self.route())
        self.route()

    def receive(self, now_us: int, frame: CanFrame) -> bool:
        """Take a frame; False if it is no PDO of a proxy."""
        routes = self._sources.get(frame.can_id, ())
        for node, source in routes:
            if len(frame.data) < source.size:
                text = f"{source.layout.name}: {len(frame.data)} of {source.size} bytes"
                self._notify(ServerEventType.PDO_TOO_SHORT, node.entry.id, text)
            elif node.proxy is not None and node.proxy.passing:
                source.receive(now_us, frame.data)
        return bool(routes)

    def send_values(self) -> None:
        """Send what came to InPorts; what cannot be sent now is dropped."""
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
        """Send a value past all connectors; see `Server.put`."""
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

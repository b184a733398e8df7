"""An engine that joins the ports of a system with topics of ROS 2, according to a table."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

from tickrig.host.cli.engine_options import Ros2Options
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines import peer_ports
from tickrig.host.rtc.engines.ros2 import participant
from tickrig.host.rtc.engines.ros2.conversions import IN, OUT
from tickrig.host.rtc.engines.ros2.message_types import Stamps, message_type
from tickrig.host.rtc.engines.ros2.table_reader import parse_table
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry, TopicTable, usual_entry
from tickrig.host.rtc.engines.ros2.topics import TopicReader, TopicWriter
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.states import LifeCycleState, RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.rtc import Time

# Topics of a component that no table names: those of all its ports that a message fits.


def _usual_entries(component: RtComponent) -> tuple[TopicEntry, ...]:
    """Return an entry for each port, with the first message that fits.

    A topic is `ConsoleIn0/out`.
    """
    found = []
    for port in component.ports.values():
        if isinstance(port, InPort | OutPort):
            makers = OUT if isinstance(port, OutPort) else IN
            kinds = (name for name, kind in makers if kind is port.data_type)
            if (kind := next(kinds, None)) is not None:
                topic = f"{_token(component.instance_name)}/{_token(port.name)}"
                found.append(usual_entry(port.full_name, topic, kind))
    return tuple(found)


def _token(name: str) -> str:
    """Return a name in the form that ROS 2 allows in a topic."""
    token = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return token if token[:1].isalpha() else f"p{token}"


# States of components as a DiagnosticArray of ROS 2.

_TYPE: Final = "diagnostic_msgs/msg/DiagnosticArray"

_WARN: Final = 1
_LEVELS: Final = {LifeCycleState.ACTIVE: 0, LifeCycleState.ERROR: 2}
"""Levels of DiagnosticStatus. A component that is neither Active nor in Error is WARN."""


class _Diagnostics:
    """A publisher of the states of all components in each period. The manager ticks it.

    Args:
        manager: manager with the components.
        stamps: converter from times of the system to times of the machine.
        period_us: interval of the messages.
        send: function that is called with each message.
    """

    def __init__(
        self, manager: Manager, stamps: Stamps, period_us: int, send: Callable[[Any], object]
    ) -> None:
        self._manager, self._stamps, self._send = manager, stamps, send
        self._period_us, self.due_us = period_us, manager.now_us + period_us
        self._array, self._status = message_type(_TYPE), message_type(_part("DiagnosticStatus"))
        self._value = message_type(_part("KeyValue"))
        self._header = message_type("std_msgs/msg/Header")
        self._time = message_type("builtin_interfaces/msg/Time")

    def tick(self, now_us: int) -> None:
        """Publish the states if that is due."""
        if now_us < self.due_us:
            return
        self.due_us += self._period_us * (1 + (now_us - self.due_us) // self._period_us)
        stamp = self._time(*self._stamps.to_ros(Time.from_us(now_us)))
        statuses = [self._of(component) for component in self._manager.components]
        self._send(self._array(self._header(stamp, ""), statuses))

    def _of(self, component: RtComponent) -> Any:
        name, spec = component.instance_name, component.spec
        context = component.contexts[0] if component.contexts else None
        state = context.state_of(component) if context else LifeCycleState.CREATED
        rate = f"{context.rate_hz:g}" if context else "0"
        pairs = {"type": spec.type_name, "rate_hz": rate, "version": spec.version}
        values = [self._value(*pair) for pair in pairs.items()]
        level = _LEVELS.get(state, _WARN)
        return self._status(level, name, state.name.capitalize(), spec.vendor, values)


def _part(name: str) -> str:
    return f"diagnostic_msgs/msg/{name}"


_CLOSE_US: Final = 1_000_000

_LOG: Final = log_of(__name__)


@contextmanager
def ros2_joined(options: Ros2Options, manager: Manager, calls: CallQueue) -> Iterator[None]:
    """Context manager that connects the ports of a system with ROS 2 topics.

    Ports of components that are added later are connected too.

    Raises:
        OSError: the table of ports and topics cannot be read.
        ValueError: the table, the DDS domain or the network interface is invalid, or the table does
            not fit the present components.
    """
    table = _read_table(options)
    _refuse_mistakes(table, manager)
    engine = _Ros2Engine(options, table, manager, calls)
    manager.on_added.append(engine.join)
    try:
        yield
    finally:
        manager.on_added.remove(engine.join)
        engine.close()


def _read_table(options: Ros2Options) -> TopicTable:
    """Return the given table, or the table of the command, or a table of all ports.

    Raises:
        OSError: the table cannot be read.
        ValueError: the table is invalid. The message has a line for each mistake.
    """
    if options.table is not None:
        return parse_table(options.table.read_text("utf-8"), str(options.table))
    return parse_table(options.topics, "topics") if options.topics else TopicTable()


def _refuse_mistakes(table: TopicTable, manager: Manager) -> None:
    """Raise ValueError with a line for each entry that does not fit the present components."""
    components = {each.instance_name: each for each in manager.components}
    mistakes = []
    for entry in table.entries or ():
        if component := components.get(entry.port.partition(".")[0]):
            mistakes += _mistakes_of(entry, component)
    if mistakes:
        raise ValueError("\n".join(mistakes))
    owners = {entry.port.partition(".")[0]: None for entry in table.entries or ()}
    if absent := ", ".join(name for name in owners if name not in components):
        _LOG.warning("ros2: no %s yet; topics come with the components", absent)


def _mistakes_of(entry: TopicEntry, component: RtComponent) -> list[str]:
    """Return why the port of an entry cannot have its topic, if it cannot."""
    name = entry.port.partition(".")[2]
    if (port := component.ports.get(name)) is None:
        known = ", ".join(component.ports) or "none"
        return [f"{entry}: {component.instance_name} has no port {name!r}; known: {known}"]
    if not isinstance(port, InPort | OutPort):
        return [f"{entry} is a {port.port_type}; topics are for data ports"]
    makers = OUT if isinstance(port, OutPort) else IN
    if (entry.type, port.data_type) in makers:
        return []
    fitting = [name for name, kind in makers if kind is port.data_type] or ["no message"]
    return [f"{entry} carries {port.data_type.idl_id()}: {', '.join(fitting)}, not {entry.type}"]


class _Ros2Engine:
    """An engine that reads and writes topics in its own threads, and joins them with ports.

    Args:
        options: domain and interface of the engine.
        table: table with the ports and their topics.
        manager: manager of the system.
        calls: queue that runs calls in the manager's thread.

    Raises:
        ValueError: the domain or the interface is invalid.
    """

    def __init__(
        self, options: Ros2Options, table: TopicTable, manager: Manager, calls: CallQueue
    ) -> None:
        self._table, self._manager, self._calls = table, manager, calls
        self._participant = participant.DdsParticipant(options.domain, options.interface)
        self._stamps = Stamps(lambda: manager.now_us)
        self._writing: dict[str, participant.OwnEndpoint] = {}
        self._reading: dict[str, participant.OwnEndpoint] = {}
        self._out, self._in = PeerThread("ros2 out"), PeerThread("ros2 in")
        self._endpoints: list[TopicReader | TopicWriter] = []
        self._foreign = participant.ForeignEndpoints(
            self._participant, self._writing, self._reading
        )
        calls.post(self._stamps.start)  # again, when the clock has started
        for component in manager.components:
            self.join(component)
        self._diagnostics = self._add_diagnostics()
        self._in.submit(self._foreign.look)

    def join(self, component: RtComponent) -> None:
        """Connect the ports of a component with topics. Log failures in one line."""
        name = component.instance_name
        entries = self._table.entries
        if entries is None:
            entries = _usual_entries(component)
        for entry in entries:
            if entry.port.partition(".")[0] != name:
                continue
            if mistakes := _mistakes_of(entry, component):
                _LOG.warning("%s", *mistakes)
                continue
            try:
                self._join_port(component.ports[entry.port.partition(".")[2]], entry)
            except RtcRefused as error:
                _LOG.warning("%s: %s", entry, error)

    def close(self) -> None:
        """End all connectors, and leave the domain."""
        self._manager.remove_item(self._diagnostics)
        for component in self._manager.components:
            for port in component.ports.values():
                for connector in port.connectors:
                    if connector.profile.connector_id.startswith(_ID):
                        connector.end()
        self._out.close(_CLOSE_US)
        self._in.close(_CLOSE_US)
        for endpoint in self._endpoints:
            endpoint.close()
        self._foreign.close()
        self._participant.close()

    def _join_port(self, port: Any, entry: TopicEntry) -> None:
        connector: Any
        endpoint: TopicReader | TopicWriter
        if isinstance(port, OutPort):
            connector, endpoint = self._push(port, entry)
            thread, own = self._out, self._writing
        else:
            connector, endpoint = self._take(port, entry)
            thread, own = self._in, self._reading
        connector.begin()
        own[participant.dds_topic(entry.topic)] = endpoint
        self._endpoints.append(endpoint)
        thread.submit(endpoint.open)

        def ended(profile: Any) -> None:
            if profile is connector.profile:
                self._endpoints.remove(endpoint)
                thread.submit(endpoint.close)

        port.on_disconnect.append(ended)

    def _push(self, port: OutPort[Any], entry: TopicEntry) -> tuple[Any, TopicWriter]:
        writer = TopicWriter(self._participant, entry)
        encode = OUT[entry.type, port.data_type](entry, self._stamps)
        codec = peer_ports.Codec(_logging(entry, encode), _no_value)
        return peer_ports.OutPortPushConnector(port, _end(entry), codec, writer, self._out), writer

    def _take(self, port: InPort[Any], entry: TopicEntry) -> tuple[Any, TopicReader]:
        convert = IN[entry.type, port.data_type](entry, self._stamps)
        zero = port.data_type()

        def decode(message: Any) -> Any:
            return zero if message is None else convert(message)

        codec = peer_ports.Codec(_no_value, decode)
        connector = peer_ports.InPortPushConnector(port, _end(entry), codec, self._calls)
        return connector, TopicReader(self._participant, entry, self._in, connector.put)

    def _add_diagnostics(self) -> _Diagnostics:
        topic, period_us = self._table.diagnostics, self._table.period_us
        entry = TopicEntry("diagnostics", topic, _TYPE)
        writer = TopicWriter(self._participant, entry)

        def send(message: Any) -> None:
            # A call that returns 0 is made again, and PORT_OK is 0.
            self._out.submit(partial(_put, writer, message))

        item = _Diagnostics(self._manager, self._stamps, period_us, send)
        if topic:
            self._writing[participant.dds_topic(topic)] = writer
            self._endpoints.append(writer)
            self._out.submit(writer.open)
            self._manager.add_item(item)
        return item


def _put(writer: TopicWriter, message: Any) -> None:
    """Write a message once: a call that returns 0 is repeated, and PORT_OK is 0."""
    writer.put(message)


_ID: Final = "ros2:/"


def _end(entry: TopicEntry) -> peer_ports.PeerEnd:
    properties = {"ros2.type": entry.type}
    return peer_ports.PeerEnd(
        f"{_ID}{entry.topic}", f"{_ID}{entry.topic}", properties, f"/{entry.topic}"
    )


def _no_value(value: Any) -> Any:
    raise ValueError("this connector goes the other way")


def _logging(entry: TopicEntry, encode: Any) -> Any:
    """Return an encoder that logs the first value that cannot be a message, in one line."""
    warned = False

    def encoded(value: Any) -> Any:
        nonlocal warned
        try:
            return encode(value)
        except (ValueError, OverflowError) as error:
            if not warned:
                _LOG.warning("%s: no %s: %s", entry, entry.type, error)
            warned = True
            raise ValueError(str(error)) from error

    return encoded

"""Make connectors between ports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from tickrig.host.rtc.ports.connector import Connector, ConnectorOptions
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile, automatic_id
from tickrig.host.rtc.ports.service_port import Consumer, Provider, ServiceConnector, ServicePort
from tickrig.host.rtc.states import ReturnCode, RtcRefused

Properties = Mapping[str, str]


def connect(
    first: AnyPort,
    second: AnyPort,
    properties: Properties | None = None,
    *,
    name: str = "",
    connector_id: str = "",
) -> ConnectorBase:
    """Connect an OutPort with an InPort, or two service ports, and return the connector.

    Args:
        first: one of the two ports, in any order.
        second: other port.
        properties: properties `dataport.*` of a connector between data ports; see
            `ConnectorOptions.parse`.
        name: name of the connector, for display. By default, it is the ID.
        connector_id: ID that is unique in a system. By default, it is made from the names of the
            ports.

    Raises:
        RtcRefused: the ports do not fit or are already connected, one of them has a connector with
            this ID, or a property has an invalid value.
    """
    if first is second:
        raise RtcRefused(f"{first.full_name} is one port; a connector joins two")
    if first.connector_to(second):
        message = f"{first.full_name} and {second.full_name} are connected"
        raise RtcRefused(message, ReturnCode.PRECONDITION_NOT_MET)
    for port in (first, second) if connector_id else ():
        refuse_known_id(port, connector_id)
    connector = _connector(first, second, properties or {}, _ConnectorNames(name, connector_id))
    connector.begin()
    return connector


def refuse_known_id(port: AnyPort, connector_id: str) -> None:
    """Raise RtcRefused (PRECONDITION_NOT_MET) if a port has a connector with this ID."""
    if port.find_connector(connector_id):
        message = f"{port.full_name} has a connector {connector_id!r} already"
        raise RtcRefused(message, ReturnCode.PRECONDITION_NOT_MET)


class _ConnectorNames(NamedTuple):
    """The name and ID that a caller wants for a connector, empty for the defaults."""

    name: str
    connector_id: str


def _connector(
    first: AnyPort, second: AnyPort, properties: Properties, names: _ConnectorNames
) -> ConnectorBase:
    match first, second:
        case OutPort(), InPort():
            return _data_connector(first, second, properties, names)
        case InPort(), OutPort():
            return _data_connector(second, first, properties, names)
        case ServicePort(), ServicePort():
            return _service_connector(first, second, properties, names)
    kinds = f"{first.port_type} {first.full_name}, {second.port_type} {second.full_name}"
    raise RtcRefused(f"{kinds} do not fit: an OutPort and an InPort, or service ports do")


def _profile(
    first: AnyPort, second: AnyPort, properties: Properties, names: _ConnectorNames
) -> ConnectorProfile:
    ports = (first.full_name, second.full_name)
    connector_id = names.connector_id or automatic_id(ports)
    return ConnectorProfile(names.name or connector_id, connector_id, ports, properties)


def _data_connector(
    out: OutPort[Any], in_: InPort[Any], properties: Properties, names: _ConnectorNames
) -> ConnectorBase:
    if out.data_type is not in_.data_type:
        raise RtcRefused(
            f"{out.full_name} carries {out.data_type.idl_id()},"
            f" {in_.full_name} {in_.data_type.idl_id()}"
        )
    options = ConnectorOptions.parse(properties)
    stated = {"dataport.data_type": out.data_type.idl_id(), **options.stated, **properties}
    return Connector(_profile(out, in_, stated, names), (out, in_), options)


def _service_connector(
    first: ServicePort, second: ServicePort, properties: Properties, names: _ConnectorNames
) -> ConnectorBase:
    pairs = (*_pairs(first, second), *_pairs(second, first))
    if not pairs:
        raise RtcRefused(f"{first.full_name} and {second.full_name} share no interface type")
    return ServiceConnector(_profile(first, second, properties, names), (first, second), pairs)


def _pairs(
    calling: ServicePort, called: ServicePort
) -> Iterator[tuple[Consumer[Any], Provider[Any]]]:
    """Find a provider for each consumer.

    The provider has the same type as the consumer, and if possible the same instance name.
    """
    for consumer in calling.consumers:
        wanted = consumer.profile
        fitting = [p for p in called.providers if p.profile.type_name == wanted.type_name]
        fitting.sort(key=lambda p: p.profile.instance_name != wanted.instance_name)
        if fitting and not consumer.connected:
            yield consumer, fitting[0]

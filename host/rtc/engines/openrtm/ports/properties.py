"""Properties of ports and connectors: NVLists of CORBA, and the texts in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from omniORB import any as omni_any

from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.data_port import DataPort, InPort
from tickrig.host.rtc.states import RtcRefused
from tickrig.wire.rtc_types.cdr import Endian

Properties = list[Any]
"""An NVList: each has a `name` and a `value`, an Any."""

ENDIAN: Final = "dataport.serializer.cdr.endian"
DATA_TYPE: Final = "dataport.data_type"
INTERFACE: Final = "dataport.interface_type"
CORBA_CDR: Final = "corba_cdr"
DIRECT: Final = "direct"
"""Between ports of one process; saved systems have it, and rtresurrect asks for it again."""

_BOTH: Final = ",".join(Endian)


def texts(properties: Properties) -> dict[str, str]:
    """Return what the properties say that are texts or numbers; others mean nothing here."""
    found: dict[str, str] = {}
    for item in properties:
        value = item.value.value()
        if isinstance(value, str | int | float):
            found[item.name] = str(value)
    return found


def changed(properties: Properties, values: Mapping[str, str]) -> Properties:
    """Return properties with some values; all others pass as they came."""
    kept = [item for item in properties if item.name not in values]
    return kept + nvlist(values)


def nvlist(values: Mapping[str, str]) -> Properties:
    """Return properties that are texts."""
    name_value = stubs().sdo.NameValue
    return [name_value(name, omni_any.to_any(text)) for name, text in values.items()]


def completed(properties: Properties) -> Properties:
    """Return properties of a connector with the byte orders, if nobody named one."""
    return properties if ENDIAN in texts(properties) else changed(properties, {ENDIAN: _BOTH})


def agreed_endian(text: str) -> Endian:
    """Return the first byte order of a list that is known here, little if none was named.

    Raises:
        RtcRefused: none of them is known.
    """
    words = [word.strip().lower() for word in text.split(",") if word.strip()] or [Endian.LITTLE]
    known = [endian for word in words for endian in Endian if endian == word]
    if not known:
        raise RtcRefused(f"{ENDIAN}: {text!r} is none of: {', '.join(Endian)}")
    return known[0]


def agreed(port: DataPort[Any], values: dict[str, str]) -> dict[str, str]:
    """Return what holds for a connector of a data port with a peer.

    Raises:
        RtcRefused: another interface type than corba_cdr, another data type than the port's, or
            a byte order that nobody knows.
    """
    if (interface := values.get(INTERFACE, CORBA_CDR)) != CORBA_CDR:
        raise RtcRefused(f"{INTERFACE}: {interface!r} is not {CORBA_CDR}")
    ours = port.data_type.idl_id()
    if (theirs := values.get(DATA_TYPE, ours)) not in (ours, port.data_type.__name__):
        raise RtcRefused(f"{DATA_TYPE}: {theirs!r} is not {ours}")
    return {**values, INTERFACE: CORBA_CDR, ENDIAN: agreed_endian(values.get(ENDIAN, ""))}


def offered(port: DataPort[Any]) -> dict[str, str]:
    """Return what a data port offers to peers; rtcon compares it with what theirs offers."""
    subscriptions = "Any" if isinstance(port, InPort) else "flush,new,periodic"
    return {
        "port.port_type": port.port_type,
        DATA_TYPE: port.data_type.idl_id(),
        INTERFACE: f"{CORBA_CDR},{DIRECT}",
        "dataport.dataflow_type": "push,pull",
        "dataport.subscription_type": subscriptions,
    }

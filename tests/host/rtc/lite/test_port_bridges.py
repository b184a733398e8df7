"""Ports of a proxy and values on their way, for all data types."""

from __future__ import annotations

from typing import Any

import pytest

from tests.wire.rtc_lite.vectors import VECTORS
from tickrig.host.links.link import DeviceRefused
from tickrig.host.rtc import InPort, OutPort, connect
from tickrig.host.rtc.lite.proxy import PortBridges
from tickrig.wire.rtc_lite.messages import LitePortData, LitePortProfile
from tickrig.wire.rtc_types.rtc import Time


def both_ways(code: str) -> tuple[PortBridges, OutPort[Any], InPort[Any]]:
    """The ports of a device with one in-port and one out-port, and what is joined to them."""
    relays = PortBridges([LitePortProfile(code, b"in")], [LitePortProfile(code, b"out")])
    in_port, out_port = relays.ports
    assert isinstance(in_port, InPort)
    assert isinstance(out_port, OutPort)
    source, sink = OutPort("source", in_port.data_type), InPort("sink", out_port.data_type)
    connect(source, in_port, {"dataport.interface_type": "corba_cdr"})
    connect(out_port, sink, {"dataport.interface_type": "corba_cdr"})
    return relays, source, sink


@pytest.mark.parametrize("row", VECTORS["marshalling"], ids=lambda row: row["type"])
def test_a_golden_value_passes_in_and_out(row: dict[str, Any]) -> None:
    payload = bytes.fromhex(row["bytes"])
    relays, source, sink = both_ways(row["type"])
    relays.give(7_000_000, LitePortData(b"out", payload))
    value = sink.read()
    assert value is not None
    assert value.tm == Time(7, 0)
    source.write(value)
    assert list(relays.fresh()) == [LitePortData(b"in", payload)]
    assert relays.dropped == 0


def test_one_value_a_period_goes_in() -> None:
    relays, source, _ = both_ways("l")
    for number in (1, 2):
        source.write(source.data_type(Time(), number))
    assert [data.data[0] for data in relays.fresh()] == [1]
    assert [data.data[0] for data in relays.fresh()] == [2]
    assert list(relays.fresh()) == []


def test_an_empty_sequence_of_characters_passes() -> None:
    relays, source, sink = both_ways("C")
    relays.give(0, LitePortData(b"out", b""))
    value = sink.read()
    assert value is not None
    source.write(value)
    assert list(relays.fresh()) == [LitePortData(b"in", b"")]


def test_a_value_that_does_not_fit_into_a_frame_is_dropped(
    caplog: pytest.LogCaptureFixture,
) -> None:
    relays, source, _ = both_ways("L")
    source.write(source.data_type(Time(), tuple(range(15))))
    source.write(source.data_type(Time(), (1,)))
    assert list(relays.fresh()) == []
    assert len(list(relays.fresh())) == 1
    assert relays.dropped == 1
    assert "dropped at in: name and data make 64 data bytes, 60 fit" in caplog.text


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (LitePortData(b"out", b"\1\2\3"), "dropped at out: TimedLong of 3 bytes"),
        (LitePortData(b"no", b"\1\2\3\4"), "dropped at an out-port that was not described: b'no'"),
    ],
)
def test_data_that_fit_no_port_are_dropped(
    data: LitePortData, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    relays, _, sink = both_ways("l")
    relays.give(0, data)
    assert not sink.is_new
    assert relays.dropped == 1
    assert text in caplog.text


def test_a_type_that_nobody_knows_is_refused() -> None:
    with pytest.raises(DeviceRefused, match="port 'in' has type 'q'; known: b c o s l f d B C"):
        PortBridges([LitePortProfile("q", b"in")])

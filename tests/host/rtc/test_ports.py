from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc import InPort, OutPort, PortStatus, ReturnCode, RtcRefused, connect
from tickrig.host.rtc.ports.connector import Connector
from tickrig.host.rtc.ports.port import AnyPort, Listener
from tickrig.host.rtc.ports.ring_buffer import BufferOptions, FullPolicy, ReadPolicy, RingBuffer
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.rtc import Time, TimedDouble, TimedLong

OK = PortStatus.PORT_OK


class Pair:
    """An OutPort and an InPort of longs, joined with given properties."""

    def __init__(self, properties: dict[str, str] | None = None) -> None:
        self.out, self.in_ = OutPort("out", TimedLong), InPort("in", TimedLong)
        keys = {f"dataport.{key}": text for key, text in (properties or {}).items()}
        connector = connect(self.out, self.in_, keys)
        assert isinstance(connector, Connector)
        self.connector: Connector[Any] = connector

    def write(self, *numbers: int) -> list[PortStatus]:
        return [self.out.write(TimedLong(data=number)) for number in numbers]

    def read(self) -> int | None:
        value = self.in_.read()
        return None if value is None else value.data

    def drain(self) -> list[int | None]:
        """Read while there is something new."""
        numbers = []
        while self.in_.is_new:
            numbers.append(self.read())
        return numbers


def test_values_are_read_in_the_order_in_which_they_were_written() -> None:
    pair = Pair()
    assert pair.write(1, 2, 3) == [OK, OK, OK]
    assert pair.drain() == [1, 2, 3]


def test_without_a_new_value_the_last_one_is_read_back() -> None:
    pair = Pair()
    assert (pair.in_.is_new, pair.read()) == (False, None)
    pair.write(1)
    assert [pair.read(), pair.read()] == [1, 1]
    assert not pair.in_.is_new


@pytest.mark.parametrize("policy", ["do_nothing", "block"])
def test_other_empty_policies_read_nothing(policy: str) -> None:
    pair = Pair({"buffer.read.empty_policy": policy})
    pair.write(1)
    assert [pair.read(), pair.read()] == [1, None]


@pytest.mark.parametrize(
    ("policy", "status", "kept"),
    [
        ("overwrite", OK, [2, 3]),
        ("do_nothing", PortStatus.BUFFER_FULL, [1, 2]),
        ("block", PortStatus.BUFFER_TIMEOUT, [1, 2]),
    ],
)
def test_a_full_buffer_does_what_its_policy_says(
    policy: str, status: PortStatus, kept: list[int]
) -> None:
    pair = Pair({"buffer.length": "2", "buffer.write.full_policy": policy})
    assert pair.write(1, 2, 3) == [OK, OK, status]
    assert pair.drain() == kept


@pytest.mark.parametrize(
    ("properties", "read"),
    [
        ({"buffer.read.policy": "fifo"}, [1, 2, 3, 4, 5]),
        ({"buffer.read.policy": "last"}, [5]),
        ({"buffer.read.policy": "skip", "buffer.read.skip_count": "1"}, [2, 4]),
        ({"buffer.read.policy": "skip", "buffer.read.skip_count": "2"}, [3]),
    ],
)
def test_the_read_policy_chooses_among_the_waiting_values(
    properties: dict[str, str], read: list[int]
) -> None:
    pair = Pair(properties)
    pair.write(1, 2, 3, 4, 5)
    assert pair.drain() == read


def test_the_default_buffer_holds_eight_values() -> None:
    pair = Pair()
    pair.write(*range(10))
    assert pair.drain() == list(range(2, 10))


@given(
    st.lists(st.one_of(st.integers(0, 99), st.none())),
    st.integers(1, 4),
    st.sampled_from(FullPolicy),
)
def test_a_ring_buffer_is_a_list_with_an_end(
    steps: list[int | None], length: int, full: FullPolicy
) -> None:
    buffer, model = RingBuffer[int](BufferOptions(length, full)), list[int]()
    for step in steps:
        if step is not None:
            status = buffer.write(step)
            assert (status is OK) is (len(model) < length or full is FullPolicy.OVERWRITE)
            model = [*model, step][-length:] if status is OK else model
        elif model:
            assert buffer.read() == model.pop(0)
        assert (len(buffer), buffer.readable) == (len(model), bool(model))
    assert buffer.clear() == tuple(model)


@pytest.mark.parametrize(("length", "skip_count"), [(0, 0), (-1, 0), (4, 4), (4, -1)])
def test_a_buffer_that_cannot_be_is_a_value_error(length: int, skip_count: int) -> None:
    with pytest.raises(ValueError, match=r"length|skip_count"):
        BufferOptions(length, read=ReadPolicy.SKIP, skip_count=skip_count)


def test_one_out_port_writes_to_many() -> None:
    pair, other = Pair(), InPort("other", TimedLong)
    connect(other, pair.out)
    pair.write(7)
    assert (pair.read(), other.read()) == (7, TimedLong(data=7))


def test_a_full_buffer_does_not_keep_a_value_from_the_others() -> None:
    pair, other = Pair(), InPort("other", TimedLong)
    pair = Pair({"buffer.length": "1", "buffer.write.full_policy": "do_nothing"})
    connect(pair.out, other)
    assert pair.write(1, 2) == [OK, PortStatus.BUFFER_FULL]
    assert [other.read(), other.read()] == [TimedLong(data=1), TimedLong(data=2)]


def test_one_in_port_reads_from_many_those_made_first_first() -> None:
    pair, other = Pair(), OutPort("other", TimedLong)
    connect(other, pair.in_)
    other.write(TimedLong(data=2))
    pair.write(1)
    assert pair.drain() == [1, 2]
    assert pair.read() == 2


def test_clear_drops_what_was_not_read() -> None:
    pair = Pair()
    pair.write(1, 2)
    pair.in_.clear()
    assert pair.drain() == []


def test_a_value_of_another_type_is_a_type_error() -> None:
    out: OutPort[Any] = OutPort("out", TimedLong)
    with pytest.raises(TypeError, match="out takes TimedLong, not TimedDouble"):
        out.write(TimedDouble())


def test_a_write_without_connectors_is_no_error() -> None:
    assert OutPort("out", TimedLong).write(TimedLong()) is OK


@pytest.mark.parametrize("endian", ["little", "big", "big,little"])
def test_corba_cdr_takes_a_value_through_its_bytes(endian: str) -> None:
    pair = Pair({"interface_type": "corba_cdr", "serializer.cdr.endian": endian})
    assert pair.write(-5, 2**31) == [OK, PortStatus.INVALID_ARGS]
    assert pair.drain() == [-5]


def test_pull_reads_from_the_buffer_of_the_out_port() -> None:
    pair = Pair({"dataflow_type": "pull", "outport.buffer.length": "1"})
    pair.write(1, 2)
    assert pair.connector.due_us == NEVER
    assert pair.drain() == [2]


def test_new_pushes_at_the_next_tick() -> None:
    pair = Pair({"subscription_type": "new"})
    assert pair.connector.due_us == NEVER
    pair.write(1, 2)
    assert (pair.connector.due_us, pair.drain()) == (0, [])
    pair.connector.tick(1_000)
    assert (pair.connector.due_us, pair.drain()) == (NEVER, [2])


@pytest.mark.parametrize(
    ("policy", "first", "second"),
    [
        ({"push_policy": "all"}, [1, 2, 3], [4, 5]),
        ({"push_policy": "fifo"}, [1, 2, 3], [4, 5]),
        ({"push_policy": "new"}, [3], [5]),
        ({"push_policy": "skip", "skip_count": "1"}, [2], [4]),
        ({"push_policy": "skip", "skip_count": "0"}, [1, 2, 3], [4, 5]),
    ],
)
def test_the_push_policy_chooses_what_is_pushed(
    policy: dict[str, str], first: list[int], second: list[int]
) -> None:
    keys = {f"publisher.{key}": text for key, text in policy.items()}
    pair = Pair({"subscription_type": "new", **keys})
    pair.write(1, 2, 3)
    pair.connector.tick(1)
    assert pair.drain() == first
    pair.write(4, 5)
    pair.connector.tick(2)
    assert pair.drain() == second


def test_periodic_pushes_at_multiples_of_its_period() -> None:
    pair = Pair(
        {
            "subscription_type": "periodic",
            "publisher.push_rate": "100",
            "publisher.push_policy": "fifo",
        }
    )
    pair.write(1, 2)
    pair.connector.tick(3_000)
    assert (pair.connector.due_us, pair.drain()) == (10_000, [])
    pair.connector.tick(10_000)
    assert (pair.connector.due_us, pair.drain()) == (20_000, [1])
    pair.connector.tick(20_001)
    assert (pair.connector.due_us, pair.drain()) == (NEVER, [2])


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("interface_type", "corba_any"),
        ("dataflow_type", "PUSH"),
        ("subscription_type", "sometimes"),
        ("publisher.push_policy", "last"),
        ("publisher.skip_count", "-1"),
        ("publisher.push_rate", "fast"),
        ("publisher.push_rate", "0"),
        ("serializer.cdr.endian", "middle"),
        ("buffer.length", "0"),
        ("inport.buffer.length", "many"),
        ("outport.buffer.write.full_policy", "shrink"),
        ("buffer.read.empty_policy", ""),
        ("buffer.read.skip_count", "8"),
    ],
)
def test_a_property_that_cannot_be_is_refused_by_its_name(key: str, text: str) -> None:
    with pytest.raises(RtcRefused, match=r"dataport\.\w*") as refused:
        Pair({key: text})
    assert refused.value.code is ReturnCode.BAD_PARAMETER


def test_ports_of_different_types_are_not_connected() -> None:
    with pytest.raises(RtcRefused, match=r"out carries IDL:RTC/TimedLong:1.0, in IDL:RTC/TimedD"):
        connect(OutPort("out", TimedLong), InPort("in", TimedDouble))


def test_two_out_ports_are_not_connected() -> None:
    with pytest.raises(RtcRefused, match="do not fit"):
        connect(OutPort("a", TimedLong), OutPort("b", TimedLong))


def test_two_ports_are_connected_once() -> None:
    pair = Pair()
    with pytest.raises(RtcRefused, match="are connected") as refused:
        connect(pair.in_, pair.out)
    assert refused.value.code is ReturnCode.PRECONDITION_NOT_MET


def test_both_ports_tell_their_listeners_once_a_connector_is_there_and_gone() -> None:
    out, in_ = OutPort("out", TimedLong), InPort("in", TimedLong)
    told: list[tuple[str, str, int]] = []

    def teller(what: str, name: str) -> Listener:
        return lambda profile: told.append((what, name, len(in_.connectors)))

    ports: tuple[AnyPort, ...] = (out, in_)
    for port in ports:
        port.on_connect.append(teller("on", port.name))
        port.on_disconnect.append(teller("off", port.name))
    connector = connect(out, in_)
    connector.end()
    connector.end()
    assert told == [("on", "out", 1), ("on", "in", 1), ("off", "out", 0), ("off", "in", 0)]


def test_after_the_end_of_a_connector_nothing_arrives_but_the_last_value_stays() -> None:
    pair = Pair()
    pair.write(1)
    assert pair.read() == 1
    pair.out.disconnect_all()
    pair.write(2)
    assert (pair.in_.is_new, pair.read()) == (False, 1)
    assert pair.in_.connectors == ()


def test_a_profile_has_the_names_of_openrtm() -> None:
    pair = Pair()
    assert pair.in_.profile.properties == {
        "port.port_type": "DataInPort",
        "dataport.data_type": "IDL:RTC/TimedLong:1.0",
        "dataport.interface_type": "direct, corba_cdr",
        "dataport.dataflow_type": "push, pull",
        "dataport.subscription_type": "flush, new, periodic",
    }
    (profile,) = pair.out.profile.connector_profiles
    assert (profile.name, profile.ports) == ("out_in", ("out", "in"))
    assert profile.properties == {
        "dataport.data_type": "IDL:RTC/TimedLong:1.0",
        "dataport.interface_type": "direct",
        "dataport.dataflow_type": "push",
        "dataport.subscription_type": "flush",
    }


def test_the_time_stamp_passes_unchanged() -> None:
    pair = Pair()
    pair.out.write(TimedLong(Time(3, 4), 5))
    assert pair.in_.read() == TimedLong(Time(3, 4), 5)

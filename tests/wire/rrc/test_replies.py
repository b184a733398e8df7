from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.errors import ChecksumError, FieldError, FramingError, WireError
from tickrig.wire.rrc.message import check_digit
from tickrig.wire.rrc.replies import Event, Ok, Refusal, Reply, RrcEvent, StatusA, Text, parse_reply

percents = st.integers(-100, 100)
counts = st.integers(0, 15)
statuses = st.builds(
    StatusA,
    *[percents] * 4,
    st.integers(1, 10),
    st.integers(1, 5),
    *[counts] * 3,
)
names = st.from_regex(r"[A-Za-z0-9]{1,20}", fullmatch=True)
replies: st.SearchStrategy[Reply] = st.one_of(
    statuses, st.builds(Ok, names), st.builds(Refusal, names), st.builds(Event, names)
)


@pytest.mark.unmeasured
@given(replies)
def test_what_was_written_is_read_back(reply: Reply) -> None:
    assert parse_reply(reply.encode()[:-1]) == reply


def test_a_status_has_signed_percentages_and_counts() -> None:
    status = StatusA(100, -1, -100, 0, 10, 1, 15, 2, 0)
    assert status.encode()[:-2] == b"SA:64FF9C00A1F20"
    assert parse_reply(status.encode()[:-1]) == status


@given(st.binary() | st.binary(min_size=14, max_size=14).map(b"SA:".__add__))
def test_noise_is_a_wire_error_or_a_reply(line: bytes) -> None:
    try:
        reply = parse_reply(line)
    except WireError:
        return
    assert isinstance(reply, Ok | Refusal | Event | StatusA | Text)


@pytest.mark.parametrize("line", [b"OK:out\xf4ut", b"ER:\x80", b"EV:Init\xffalized", b"dev\xe9ce"])
def test_a_line_that_a_fault_changed_is_written_as_it_came(line: bytes) -> None:
    assert parse_reply(line).encode() == line + b"\n"


def test_both_names_of_power_on_are_one_event() -> None:
    assert Event("PowerOn").kind is Event("PowerOnTrigger").kind is RrcEvent.POWER_ON


def test_all_sixteen_events_of_the_manual_are_known() -> None:
    assert len(RrcEvent) == 16
    assert all(Event(kind.value).kind is kind for kind in RrcEvent)


def test_an_event_of_a_newer_firmware_keeps_its_name() -> None:
    assert parse_reply(b"EV:SomethingNew") == Event("SomethingNew")
    assert Event("SomethingNew").kind is None


def test_a_line_without_a_known_prefix_is_text() -> None:
    assert parse_reply(b"Version 1.0") == Text("Version 1.0")
    assert Text("Version 1.0").encode() == b"Version 1.0\n"


@pytest.mark.parametrize(
    ("message", "error"),
    [
        (b"SA:00000000A1000", FramingError),
        (b"SA:00000000A100000", FramingError),
        (b"SA:7F000000A1000", FieldError),
        (b"SA:0000000001000", FieldError),
        (b"SA:00000000B1000", FieldError),
        (b"SA:00000000A6000", FieldError),
        (b"SA:0x000000A1000", FieldError),
    ],
)
def test_a_bad_status_line_is_told(message: bytes, error: type[WireError]) -> None:
    whole = message if error is FramingError else message + check_digit(message)
    with pytest.raises(error):
        parse_reply(whole)


def test_a_status_line_with_a_wrong_check_is_told() -> None:
    with pytest.raises(ChecksumError, match="expected b'0'"):
        parse_reply(b"SA:00000000A10001")

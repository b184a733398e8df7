from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.bench.operator import FaultSpec, parse_fault_spec
from tickrig.host.text.byte_text import escape, unescape
from tickrig.host.text.values import format_time, parse_time_us
from tickrig.wire.instant import NEVER


@given(st.binary())
def test_escaped_bytes_come_back(data: bytes) -> None:
    text = escape(data)
    assert unescape(text) == data
    assert text == text.strip()
    assert text.isascii()
    assert text.isprintable()


@pytest.mark.parametrize("text", [r"\q", "\\", r"\x1", "é", "a\nb", r"\xg0"])
def test_a_bad_escape_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not ASCII"):
        unescape(text)


@pytest.mark.parametrize(
    ("text", "t_us"),
    [("0", 0), ("1.5s", 1_500_000), ("200ms", 200_000), ("250us", 250), ("0.1", 100_000)],
)
def test_a_time_has_a_unit_or_is_in_seconds(text: str, t_us: int) -> None:
    assert parse_time_us(text) == t_us


@pytest.mark.parametrize("text", ["", "-1s", "1e3", "1m", "1 s", "s", ".", "1.", "nan", "1_0"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not a time: write"):
        parse_time_us(text)


@given(st.integers(0, 10**15 - 1))
def test_a_written_time_is_read_again(t_us: int) -> None:
    assert parse_time_us(format_time(t_us)) == t_us


@pytest.mark.parametrize(
    ("text", "spec"),
    [
        ("cut", FaultSpec("cut")),
        ("flip=0.001", FaultSpec("flip", ("0.001",))),
        ("cut@5s-7s", FaultSpec("cut", (), 5_000_000, 7_000_000)),
        ("bus_unplugged@3s", FaultSpec("bus_unplugged", (), 3_000_000, NEVER)),
        ("drop=1e-3@0-10ms", FaultSpec("drop", ("1e-3",), 0, 10_000)),
    ],
)
def test_a_fault_is_one_word(text: str, spec: FaultSpec) -> None:
    assert parse_fault_spec(text) == spec


@pytest.mark.parametrize(
    ("text", "from_us", "to_us"),
    [
        ("cut@+100ms-+2s", 5_100_000, 7_000_000),
        ("cut@+0", 5_000_000, NEVER),
        ("cut@6s-+2s", 6_000_000, 7_000_000),
        ("cut@+1s-7s", 6_000_000, 7_000_000),
    ],
)
def test_a_time_with_a_plus_is_from_now_on(text: str, from_us: int, to_us: int) -> None:
    assert parse_fault_spec(text, now_us=5_000_000) == FaultSpec("cut", (), from_us, to_us)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "is not a fault: write NAME"),
        ("a b", "is not a fault"),
        ("cut@", "'' is not a time"),
        ("cut@5s-", "'' is not a time"),
        ("cut@5s-x", "'x' is not a time"),
        ("cut@5s-5s", "ends before it begins"),
        ("cut@+", "'' is not a time"),
        ("cut@++1s", r"'\+1s' is not a time"),
        ("cut@+2s-+1s", "ends before it begins"),
    ],
)
def test_a_bad_fault_says_what_came(text: str, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        parse_fault_spec(text)

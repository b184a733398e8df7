"""Values of ports as JSON: what is written is read, what does not fit is refused in a line."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc import RtcRefused
from tickrig.host.rtc.ports.literal import literal, read_literal
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import (
    GPSData,
    GPSFixType,
    Point2D,
    Time,
    TimedBoolean,
    TimedChar,
    TimedDouble,
    TimedDoubleSeq,
    TimedLong,
    TimedOctetSeq,
    TimedPoint2D,
    TimedString,
    TimedStringSeq,
)

NOW_US = 2_000_003
NOW = Time(2, 3_000)


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (TimedLong, "-5", TimedLong(NOW, -5)),
        (TimedLong, '{"data": -5}', TimedLong(NOW, -5)),
        (TimedLong, '{"tm": {"sec": 1}, "data": 7}', TimedLong(Time(1, 0), 7)),
        (TimedDouble, "2", TimedDouble(NOW, 2.0)),
        (TimedBoolean, "true", TimedBoolean(NOW, True)),
        (TimedChar, '"x"', TimedChar(NOW, "x")),
        (TimedString, '"__import__(1)"', TimedString(NOW, "__import__(1)")),
        (TimedDoubleSeq, "[1, 2.5]", TimedDoubleSeq(NOW, (1.0, 2.5))),
        (TimedOctetSeq, "[0, 255]", TimedOctetSeq(NOW, b"\x00\xff")),
        (TimedStringSeq, '["a", "b"]', TimedStringSeq(NOW, ("a", "b"))),
        (TimedPoint2D, '{"x": 1, "y": 2}', TimedPoint2D(NOW, Point2D(1.0, 2.0))),
        (TimedPoint2D, '{"data": {"x": 1}}', TimedPoint2D(NOW, Point2D(1.0, 0.0))),
        (Point2D, '{"y": 2}', Point2D(0.0, 2.0)),
        (GPSData, '{"fixType": "GPS_FIX_DGPS"}', GPSData(NOW, fixType=GPSFixType.GPS_FIX_DGPS)),
        (GPSData, '{"fixType": 1}', GPSData(NOW, fixType=GPSFixType.GPS_FIX_NORMAL)),
    ],
)
def test_a_value_is_read_as_it_is_written(kind: type[Struct], text: str, value: Struct) -> None:
    assert read_literal(kind, json.loads(text), NOW_US) == value
    assert read_literal(kind, json.loads(json.dumps(literal(value))), 0) == value


@pytest.mark.parametrize(
    ("kind", "text", "error"),
    [
        (TimedLong, '"5"', 'TimedLong.data takes a whole number (long), not "5"'),
        (TimedLong, "5.0", "TimedLong.data takes a whole number (long), not 5.0"),
        (TimedLong, "true", "TimedLong.data takes a whole number (long), not true"),
        (TimedLong, "2147483648", "is no IDL:RTC/TimedLong:1.0"),
        (TimedLong, '{"data": 1, "x": 2}', "TimedLong has no 'x'; fields: tm, data"),
        (TimedLong, '{"data": 1, "tm": 2}', "TimedLong.tm takes an object with sec, nsec, not 2"),
        (TimedDouble, "1" + "0" * 400, "TimedDouble.data takes a number (double), not 1000"),
        (TimedBoolean, "1", "TimedBoolean.data takes true or false (boolean), not 1"),
        (TimedOctetSeq, "[256]", "TimedOctetSeq.data takes octets 0..255, not [256]"),
        (TimedOctetSeq, '"ab"', 'TimedOctetSeq.data takes a list, not "ab"'),
        (TimedDoubleSeq, '[1, "x"]', "TimedDoubleSeq.data[1] takes a number (double)"),
        (TimedPoint2D, "3", "TimedPoint2D.data takes an object with x, y, not 3"),
        (GPSData, '{"fixType": 3}', "GPSData.fixType takes one of GPS_FIX_NONE, GPS_FIX_NORMAL, "),
        (Point2D, "[1, 2]", "Point2D takes an object with x, y, not [1, 2]"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_line(kind: type[Struct], text: str, error: str) -> None:
    with pytest.raises(RtcRefused, match=re.escape(error)) as refused:
        read_literal(kind, json.loads(text), 0)
    assert "\n" not in str(refused.value)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=8,
)
KINDS: tuple[type[Struct], ...] = (TimedLong, TimedOctetSeq, TimedPoint2D, TimedChar, GPSData)


@given(st.sampled_from(KINDS), JSON)
def test_whatever_is_given_is_a_value_or_refused(kind: type[Struct], given_: Any) -> None:
    try:
        assert isinstance(read_literal(kind, given_, 0), kind)
    except RtcRefused:
        return

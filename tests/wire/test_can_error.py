from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.can import BIT_ERROR, NO_ACK, ErrorFrame, describe_error_frame
from tickrig.wire.errors import FramingError


@given(st.integers(0, 0x1FFF_FFFF), st.binary(min_size=8, max_size=8))
def test_what_was_written_is_read_back(error_class: int, data: bytes) -> None:
    frame = ErrorFrame(error_class, data)
    assert ErrorFrame.parse(str(frame)) == frame


@pytest.mark.parametrize("text", ["", "705#7F", "00000605#40", "20000020#00", "20000020#R"])
def test_another_text_says_what_it_should_look_like(text: str) -> None:
    with pytest.raises(FramingError, match="is not an error frame like 20000020#0000000000000000"):
        ErrorFrame.parse(text)


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (NO_ACK, "no acknowledge"),
        (BIT_ERROR, "protocol: single bit, bus error"),
        (
            ErrorFrame.parse("20000004#0003000000000000"),
            "controller: receive buffer overflow and transmit buffer overflow",
        ),
        (ErrorFrame.parse("20000140#0000000000000000"), "bus-off, restarted"),
        (ErrorFrame.parse("20000400#0000000000000000"), "unknown"),
    ],
)
def test_an_error_frame_says_what_failed(frame: ErrorFrame, text: str) -> None:
    assert describe_error_frame(frame) == text

from __future__ import annotations

import pytest

from tickrig.wire.can_error import BIT_ERROR, NO_ACK, ErrorFrame
from tickrig.wire.can_error_class import describe


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
    assert describe(frame) == text

from __future__ import annotations

import pytest

from tickrig.host.canmon.model.traffic import ErrorStatistics
from tickrig.wire.can import ErrorFrame, ErrorState


def controller(*frames: str) -> ErrorStatistics:
    found = ErrorStatistics()
    for text in frames:
        found.take(ErrorFrame.parse(text))
    return found


@pytest.mark.parametrize(
    ("frame", "state"),
    [
        ("20000004#0010000000000000", ErrorState.PASSIVE),
        ("20000004#0020000000000000", ErrorState.PASSIVE),
        ("20000004#0040000000000000", ErrorState.ACTIVE),
        ("20000040#0000000000000000", ErrorState.BUS_OFF),
        ("20000100#0000000000000000", ErrorState.ACTIVE),
        ("20000020#0000000000000000", None),
    ],
)
def test_an_error_frame_says_the_state(frame: str, state: ErrorState | None) -> None:
    assert controller(frame).row().state is state


def test_a_frame_that_does_not_say_it_leaves_the_state() -> None:
    row = controller("20000040#0000000000000000", "20000020#0000000000000000").row()
    assert (row.frames, row.state) == (2, ErrorState.BUS_OFF)


def test_error_active_after_passive_is_noted() -> None:
    row = controller("20000004#0030000000000000", "20000004#0040000000000000").row()
    assert row.state is ErrorState.ACTIVE


def test_counters_are_taken_where_they_are_told() -> None:
    assert controller("20000004#0010000000006080").row().tec is None
    row = controller("20000204#0010000000006080").row()
    assert (row.tec, row.rec) == (0x60, 0x80)


def test_an_overflow_of_the_controller_is_a_loss() -> None:
    row = controller("20000004#0001000000000000", "20000020#0001000000000000").row()
    assert row.overflows == 1


def test_kinds_are_counted_the_most_frequent_first() -> None:
    bit, ack = "20000088#0000010000000000", "20000020#0000000000000000"
    row = controller(bit, ack, ack).row()
    assert row.kinds == (("no acknowledge", 2), ("protocol: single bit, bus error", 1))

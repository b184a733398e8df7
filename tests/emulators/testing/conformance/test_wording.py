from __future__ import annotations

from collections.abc import Callable

import pytest

from tickrig import CanFrame
from tickrig.testing import conformance
from tickrig.wire.can import Frames

OBJECTS = {"001000": "43", "011000": "4F", "171000": "4B"}


def heart(share: float, beats: int = 1_000) -> Callable[[], Callable[[int, Frames], Frames]]:
    """Make a node 3 whose heartbeat has a share of its period, and stops after some beats."""

    def power_on() -> Callable[[int, Frames], Frames]:
        period_us = due_us = left = 0

        def answer(data: bytes) -> str:
            nonlocal period_us, due_us, left
            at = data[1:4].hex()
            if data[0] == 0x2B:
                period_us = due_us = round(int.from_bytes(data[4:6], "little") * 1_000 * share)
                left = beats
                return f"583#60{at}00000000"
            return f"583#{OBJECTS[at]}{at}00000000" if at in OBJECTS else f"583#80{at}00000206"

        def step(now_us: int, frames: Frames) -> Frames:
            nonlocal due_us, left
            asked = [frame.data for frame in frames if frame.can_id == 0x603]
            said = [answer(data) for data in asked if data[0] != 0x80]
            if asked and period_us and asked[-1][0] == 0x2B:
                due_us = now_us + period_us
            if left and due_us and now_us >= due_us:
                due_us, left = due_us + period_us, left - 1
                said.append("703#7F")
            return tuple(map(CanFrame.parse, said))

        return step

    return power_on


@pytest.mark.parametrize(("share", "mean_ms"), [(1.2, 120), (1.06, 106), (0.8, 80), (2.5, 250)])
def test_a_heartbeat_that_is_off_is_told_with_its_period(share: float, mean_ms: int) -> None:
    report = conformance(heart(share), node_id=3, only="HB-01")
    (reason,) = [result.outcome.reason for result in report.results]
    assert reason.endswith(f"703#7F each {mean_ms}.0 ms, want 100 ms, 5 % off at most")


@pytest.mark.parametrize("beats", [1, 7])
def test_a_heartbeat_that_ends_is_told_with_its_number(beats: int) -> None:
    report = conformance(heart(1, beats), node_id=3, only="HB-01")
    (reason,) = [result.outcome.reason for result in report.results]
    assert reason.endswith(f"703#7F came {beats} times, want 20 periods of 100 ms")


@pytest.mark.parametrize(
    ("check_id", "reason"),
    [
        (
            "US-04",
            "step 2: got abort 0602 0000h (object does not exist), want abort 0504 0001h, "
            "0503 0000h, 0800 0000h, 0800 0020h, 0800 0021h or 0800 0022h",
        ),
        (
            "DS-08",
            "step 1, macro refusesegments 1000:00 4 06010002 06010000 08000000: got a value, want "
            "583#6000100000000000 or abort 0601 0002h, 0601 0000h or 0800 0000h",
        ),
        ("DE-02", "step 2, read 1017:00 A534: got 0000, want A534"),
        (
            "DE-07",
            "step 1, refuse write 1000:00 00000000: got a value, want abort 0601 0002h, "
            "0601 0000h or 0800 0000h",
        ),
        ("NMT-01", "step 2: no 703#00 within 5000 ms"),
        ("NMT-03", "step 5: 0 x 703#05 in 400 ms, want 3..5"),
    ],
)
def test_a_reason_is_in_words(check_id: str, reason: str) -> None:
    (result,) = conformance(heart(1), node_id=3, only=check_id).results
    assert result.outcome.reason == reason

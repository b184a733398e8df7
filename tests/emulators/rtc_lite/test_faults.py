from __future__ import annotations

import pytest

from tests.wire.rtc_lite.vectors import raw
from tickrig.device.chance import Chance, threshold_of
from tickrig.emulators.rtc_lite.line import LINE_FAULTS

PING = raw("0A 43 59 40 01 DD")
STATE = raw("0A 43 58 40 43 1E")


@pytest.mark.parametrize(("rate", "every"), [(1, 1), (0.5, 2), (1 / 3, 3), (0.33, 3), (0.1, 10)])
def test_every_nth_answer_to_a_ping_is_lost(rate: float, every: int) -> None:
    fault = LINE_FAULTS["ping"].make(Chance(0), threshold_of(rate))
    passed = [fault(0, PING) == PING for _ in range(30)]
    assert passed == [(number + 1) % every != 0 for number in range(30)]


def test_what_stands_beside_a_ping_stays() -> None:
    fault = LINE_FAULTS["ping"].make(Chance(0), threshold_of(1))
    assert fault(0, STATE + PING + STATE) == STATE + STATE
    assert fault(0, raw("0A 43 59 01 9D")) == raw("0A 43 59 01 9D")  # the request


def test_noise_comes_before_bytes_and_changes_none() -> None:
    def heard(rate: float) -> bytes:
        return LINE_FAULTS["noise"].make(Chance(3), threshold_of(rate))(0, bytes(1_000))

    assert heard(1)[1::2] == bytes(1_000)
    assert len(set(heard(1)[::2])) > 200
    assert 1_050 < len(heard(0.1)) < 1_150

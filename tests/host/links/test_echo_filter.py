"""One's own frames that come back: told from those of others, however many were lost."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.links.echo import ECHO_US, EchoFilter
from tickrig.wire.can import CanFrame

FRAMES = st.sampled_from([CanFrame(0x181, bytes([number])) for number in range(3)])
ACTIONS = st.tuples(
    st.sampled_from(["sent", "take", "expire"]),
    st.sampled_from([0, 1, 1_000, ECHO_US // 2, ECHO_US, ECHO_US + 1]),
    st.lists(FRAMES, max_size=4),
)


@given(st.lists(ACTIONS, max_size=30))
def test_the_oldest_of_those_alike_comes_back_first(
    actions: list[tuple[str, int, list[CanFrame]]],
) -> None:
    echo, now_us, awaited = EchoFilter(), 0, list[tuple[int, CanFrame]]()
    for verb, passed_us, frames in actions:
        now_us += passed_us
        if verb == "sent":
            echo.sent(now_us, tuple(frames))
            awaited += [(now_us, frame) for frame in frames]
        elif verb == "expire":
            echo.expire(now_us)
            awaited = [(at_us, frame) for at_us, frame in awaited if at_us >= now_us - ECHO_US]
        else:
            for frame in frames:
                found = next((one for one in awaited if one[1] == frame), None)
                assert echo.take(frame) == (found is not None)
                if found is not None:
                    awaited.remove(found)


def test_nothing_is_kept_of_echoes_that_were_lost() -> None:
    echo = EchoFilter()
    for number in range(100):
        echo.sent(number, (CanFrame(0x181, bytes([number])),))
    echo.expire(2 * ECHO_US)
    assert not echo.take(CanFrame(0x181, b"\x05"))
    assert (len(echo._sent), len(echo._awaited)) == (0, 0)

"""A sound bus goes short ways, one whose faults never strike goes long ones: to the same end."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.can.can_bench import Log, some_frames
from tickrig.emulators.can.wire import CanWire
from tickrig.wire.can import Frames

NODES = 4
NEVER_STRIKES = 2.0**-80

Action = tuple[str, int, int, Frames]
"""What is done: its name, how long after the last one in us, to which node, frames sent."""

bursts = st.lists(some_frames(), max_size=4).map(tuple)
actions = st.tuples(
    st.sampled_from(("send", "send", "send", "send", "pull", "plug", "cut", "poll")),
    st.sampled_from((0, 0, 1, 40, 47, 130, 1_000)),
    st.integers(0, NODES - 1),
    bursts,
)


def run(played: list[Action], *, long_ways: bool) -> object:
    """Play some actions; return all that can be seen."""
    wire = CanWire()
    log, ends = Log(wire), [wire.end() for _ in range(NODES)]
    ends[1].accepts = frozenset({0x100, 0x181})
    if long_ways:
        for name in ("drop", "corrupt", "duplicate", "delay"):
            wire.faults.arm(name, str(NEVER_STRIKES))
    now_us, polled = 0, []
    for name, after_us, node, frames in played:
        now_us += after_us
        wire.advance(now_us)
        match name:
            case "send":
                ends[node].send(now_us, frames)
            case "pull":
                wire.disconnect(ends[node])
            case "plug":
                wire.reconnect(ends[node])
            case "cut":
                wire.cut_power(ends[node])
            case _:
                polled.append(ends[node].poll_stamped(now_us))
    wire.advance(now_us + 20_000)
    polled += [end.poll_stamped(now_us + 20_000) for end in ends]
    counters = [(end.controller.tec, end.controller.rec, end.lost) for end in ends]
    return log.lines, polled, counters, wire.due_us, wire.load_permille()


@given(st.lists(actions, max_size=30))
def test_short_and_long_ways_lead_to_the_same(played: list[Action]) -> None:
    assert run(played, long_ways=False) == run(played, long_ways=True)

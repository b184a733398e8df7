"""Contexts that go on together do as each that is ticked by itself."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc import ExecutionContext
from tickrig.host.rtc.component import ExecutionContexts
from tickrig.wire.instant import NEVER

RATES_HZ = (1.0, 30.0, 300.0, 999.0, 1_000.0)
CONTEXTS = 3
Calls = list[tuple[str, int, int]]
PLACES = st.integers(0, CONTEXTS - 1)
STEPS = st.one_of(
    st.tuples(st.just("tick"), st.just(0), st.integers(0, 4_000)),
    st.tuples(st.just("start"), PLACES, st.just(0)),
    st.tuples(st.just("stop"), PLACES, st.just(0)),
    st.tuples(st.just("remove"), PLACES, st.just(0)),
    st.tuples(st.just("add"), PLACES, st.just(0)),
    st.tuples(st.just("rate"), PLACES, st.integers(0, len(RATES_HZ) - 1)),
)


def act(context: ExecutionContext, what: str, number: int) -> None:
    match what:
        case "start":
            context.start()
        case "stop":
            context.stop()
        case "rate":
            context.set_rate(RATES_HZ[number])


@given(st.lists(STEPS, max_size=40))
def test_together_as_each_by_itself(steps: list[tuple[str, int, int]]) -> None:
    now_us = 0
    alone = [ExecutionContext(RATES_HZ[n]) for n in range(CONTEXTS)]
    grouped = [ExecutionContext(RATES_HZ[n]) for n in range(CONTEXTS)]
    group, members = ExecutionContexts(), set[int]()
    for what, place, number in steps:
        if what == "tick":
            now_us += number
            group.tick(now_us)
            for member in members:
                alone[member].tick(now_us)
        elif what == "add":
            if place not in members:
                alone[place].tick(now_us)
            members.add(place)
            group.add(grouped[place], now_us)
        elif what == "remove" and place in members:
            members.remove(place)
            group.remove(grouped[place])
        else:
            act(alone[place], what, number)
            act(grouped[place], what, number)
        assert group.due_us == min((alone[m].due_us for m in members), default=NEVER)
        assert [c.now_us for c in grouped] == [c.now_us for c in alone]
        assert [c.due_us for c in grouped] == [c.due_us for c in alone]


def test_a_group_is_due_with_the_contexts_that_run_in_it() -> None:
    group, context = ExecutionContexts(), ExecutionContext()
    context.start()
    group.tick(5_000)
    due_us = [group.due_us]
    group.add(context, 5_000)
    due_us.append(group.due_us)
    context.stop()
    due_us.append(group.due_us)
    context.start()
    due_us.append(group.due_us)
    group.remove(context)
    assert [*due_us, group.due_us] == [NEVER, 6_000, NEVER, 6_000, NEVER]

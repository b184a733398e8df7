from __future__ import annotations

import gc
from math import log2

from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.wire.instant import NEVER


def test_actions_run_by_time_and_then_by_entry() -> None:
    event_queue, done = EventQueue(), []
    for key, t_us in (("c", 30), ("a", 10), ("b", 10), ("d", 40)):
        event_queue.put(key, t_us, lambda now_us, key=key: done.append((now_us, key)))  # type: ignore[misc]
    event_queue.run(30)
    assert done == [(30, "a"), (30, "b"), (30, "c")]
    assert event_queue.due_us == 40


def test_a_key_holds_one_action() -> None:
    event_queue, done = EventQueue(), []
    event_queue.put("k", 10, lambda now_us: done.append(1))
    event_queue.put("k", 20, lambda now_us: done.append(2))
    event_queue.run(15)
    assert done == []
    event_queue.run(20)
    assert done == [2]
    event_queue.drop("k")
    assert event_queue.due_us == NEVER


def test_an_action_may_enter_another() -> None:
    event_queue, done = EventQueue(), []
    event_queue.put(
        "a", 10, lambda now_us: event_queue.put("b", now_us, lambda now_us: done.append("b"))
    )
    event_queue.run(10)
    assert done == ["b"]


class Counted(int):
    """A time that counts how often it is compared."""

    compared = 0

    def __lt__(self, other: int) -> bool:
        Counted.compared += 1
        return int(self) < int(other)


def test_the_work_of_an_action_hardly_grows_with_their_number() -> None:
    event_queue, number = EventQueue(), 4_000
    Counted.compared = 0
    for key in range(number):
        event_queue.put(key, Counted(key * 7 % number), lambda now_us: None)
    event_queue.run(number)
    assert Counted.compared < 4 * number * log2(number)


def test_what_is_forgotten_takes_no_room() -> None:
    event_queue = EventQueue()
    kept = [bytes(1) for _ in range(2)]
    for t_us in range(10_000):
        event_queue.put("k", NEVER - t_us, lambda now_us, kept=kept: kept.clear())  # type: ignore[misc]
    assert len(gc.get_referrers(kept)) < 500


MOVES = st.lists(
    st.tuples(st.sampled_from(["put", "drop", "run"]), st.integers(0, 5), st.integers(0, 20)),
    max_size=300,
)


@given(MOVES)
def test_it_does_what_a_plain_list_does(moves: list[tuple[str, int, int]]) -> None:
    event_queue = EventQueue()
    done: list[tuple[int, int]] = []
    plain: dict[int, tuple[int, int]] = {}  # in the order of entering
    expected: list[tuple[int, int]] = []
    for number, (move, key, t_us) in enumerate(moves):
        if move == "run":
            event_queue.run(t_us)
            due = sorted((k for k in plain if plain[k][0] <= t_us), key=lambda k: plain[k][0])
            expected += [(plain.pop(k)[1], t_us) for k in due]
        else:
            event_queue.drop(key)
            plain.pop(key, None)
        if move == "put":
            event_queue.put(key, t_us, lambda now_us, number=number: done.append((number, now_us)))  # type: ignore[misc]
            plain[key] = t_us, number
        assert done == expected
        assert event_queue.due_us == min((t_us for t_us, _ in plain.values()), default=NEVER)

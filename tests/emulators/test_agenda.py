from __future__ import annotations

from tickrig.device.core import NEVER
from tickrig.emulators.agenda import Agenda


def test_actions_run_by_time_and_then_by_entry() -> None:
    agenda, done = Agenda(), []
    for key, t_us in (("c", 30), ("a", 10), ("b", 10), ("d", 40)):
        agenda.put(key, t_us, lambda now_us, key=key: done.append((now_us, key)))  # type: ignore[misc]
    agenda.run(30)
    assert done == [(30, "a"), (30, "b"), (30, "c")]
    assert agenda.due_us == 40


def test_a_key_holds_one_action() -> None:
    agenda, done = Agenda(), []
    agenda.put("k", 10, lambda now_us: done.append(1))
    agenda.put("k", 20, lambda now_us: done.append(2))
    agenda.run(15)
    assert done == []
    agenda.run(20)
    assert done == [2]
    agenda.drop("k")
    assert agenda.due_us == NEVER


def test_an_action_may_enter_another() -> None:
    agenda, done = Agenda(), []
    agenda.put("a", 10, lambda now_us: agenda.put("b", now_us, lambda now_us: done.append("b")))
    agenda.run(10)
    assert done == ["b"]

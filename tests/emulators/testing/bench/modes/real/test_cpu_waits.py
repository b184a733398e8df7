from __future__ import annotations

import threading
from pathlib import Path

from tickrig.emulators.testing.bench.modes.door_watch import CpuWaits


def count(tasks: Path, thread: str, waited_ns: int) -> None:
    (tasks / thread).mkdir(exist_ok=True)
    (tasks / thread / "schedstat").write_text(f"123456 {waited_ns} 7\n")


def test_what_came_on_since_the_last_look_is_late(tmp_path: Path) -> None:
    waits = CpuWaits(tmp_path)
    count(tmp_path, "10", 80_000_000)
    waits.look(0)
    assert waits.worst_us == 0  # of before its time
    count(tmp_path, "10", 86_000_000)
    count(tmp_path, "11", 90_000_000)
    waits.look(10_000)
    assert waits.worst_us == 6_000
    count(tmp_path, "10", 87_000_000)
    count(tmp_path, "11", 99_000_000)
    waits.look(19_999)
    assert waits.worst_us == 6_000
    waits.look(20_000)
    assert waits.worst_us == 9_000


def test_many_short_waits_in_a_long_time_are_no_long_one(tmp_path: Path) -> None:
    waits = CpuWaits(tmp_path)
    count(tmp_path, "10", 0)
    waits.look(0)
    count(tmp_path, "10", 50_000_000)
    waits.look(1_000_000)
    assert waits.worst_us == 0
    count(tmp_path, "10", 56_000_000)
    waits.look(1_010_000)
    assert waits.worst_us == 6_000


def test_who_looks_may_be_spared(tmp_path: Path) -> None:
    for spares_looker in (False, True):
        waits = CpuWaits(tmp_path, spares_looker=spares_looker)
        thread = str(threading.get_native_id())
        for turn in range(2):
            count(tmp_path, thread, turn * 7_000_000)
            waits.look(turn * 10_000)
        assert waits.worst_us == (0 if spares_looker else 7_000)


def test_a_system_that_does_not_count_knows_no_waits(tmp_path: Path) -> None:
    waits = CpuWaits(tmp_path / "nothing")
    waits.look(0)
    (tmp_path / "10").mkdir()
    (tmp_path / "10" / "schedstat").write_text("0\n")
    waits = CpuWaits(tmp_path)
    waits.look(0)
    waits.look(10_000)
    assert waits.worst_us == 0

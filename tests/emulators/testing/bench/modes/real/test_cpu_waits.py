from __future__ import annotations

from pathlib import Path

from tickrig.emulators.testing.bench.modes.real.cpu_waits import CpuWaits


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


def test_a_system_that_does_not_count_knows_no_waits(tmp_path: Path) -> None:
    waits = CpuWaits(tmp_path / "nothing")
    waits.look(0)
    (tmp_path / "10").mkdir()
    (tmp_path / "10" / "schedstat").write_text("0\n")
    waits = CpuWaits(tmp_path)
    waits.look(0)
    waits.look(10_000)
    assert waits.worst_us == 0

from __future__ import annotations

import asyncio

import pytest

from tickrig import Bench
from tickrig.device import Rrc
from tickrig.emulators.testing.bench import tasks
from tickrig.emulators.testing.bench.modes import virtual_mode


async def blink(bench: Bench, times: list[int]) -> str:
    for _ in range(3):
        bench.set("stick", 10, 0)
        times.append(bench.now_us)
        await bench.sleep("15ms")
    return "blinked"


def test_a_body_sleeps_in_the_time_of_the_bench() -> None:
    times: list[int] = []
    with Bench(Rrc()) as bench:
        assert bench.run(blink(bench, times)) == "blinked"
        assert (times, bench.now_us) == ([0, 15_000, 30_000], 45_000)


def test_tasks_go_on_while_a_host_waits() -> None:
    times: list[int] = []
    with Bench(Rrc()) as bench:
        task = bench.start(blink(bench, times))
        with pytest.raises(RuntimeError, match=r"not ended yet: it waits at .*test_tasks\.py:17$"):
            task.result()
        link = bench.link
        while link.receive(100_000):
            pass
        assert (times, task.result()) == ([0, 15_000, 30_000], "blinked")


def test_a_body_waits_for_tasks_lines_and_states() -> None:
    async def body(bench: Bench) -> None:
        task = bench.start(blink(bench, []))
        assert await task == "blinked"
        bench.press("power_button")
        assert await bench.until(bench.on_line("EV:PowerOnTrigger"), "1s")
        assert await bench.edge("state") == "Standby"
        assert await bench.edge("state", within="10ms") == "Standby"
        assert not await bench.until(lambda: False, "1ms")

    with Bench(Rrc()) as bench:
        bench.run(body(bench))


def test_what_a_task_raises_is_raised_where_it_is_awaited() -> None:
    async def fail(bench: Bench) -> None:
        await bench.sleep("1ms")
        bench.set("nothing", 1)

    async def body(bench: Bench) -> None:
        await bench.start(fail(bench))

    with Bench(Rrc()) as bench, pytest.raises(ValueError, match="no input 'nothing'"):
        bench.run(body(bench))


def test_a_task_is_cancelled() -> None:
    times: list[int] = []
    with Bench(Rrc()) as bench:
        task = bench.start(blink(bench, times))
        bench.run_for("20ms")
        task.cancel()
        task.cancel()
        bench.run_for("1s")
        assert (times, task.done) == ([0, 15_000], True)
        with pytest.raises(RuntimeError, match="the task was cancelled"):
            task.result()


def test_a_cancelled_body_is_closed() -> None:
    closed: list[str] = []

    async def body(bench: Bench) -> None:
        try:
            await bench.sleep("1s")
        finally:
            closed.append("closed")

    with Bench(Rrc()) as bench:
        bench.start(body(bench)).cancel()
    assert closed == ["closed"]


def test_the_end_of_the_sleep_of_a_cancelled_task_is_no_event() -> None:
    async def body(bench: Bench) -> None:
        bench.start(bench.sleep("1000s")).cancel()
        await bench.until(lambda: False)

    with Bench(Rrc()) as bench:
        with pytest.raises(RuntimeError, match="nothing will ever happen"):
            bench.run(body(bench))
        assert bench.now_us < 10_000_000


def test_a_check_raises_only_exceptions_that_nothing_has_read() -> None:
    async def fail() -> None:
        raise ValueError("it failed")

    with Bench(Rrc()) as bench:
        bench.start(bench.sleep("1s"))
        bench.check_tasks()
        task = bench.start(fail())
        with pytest.raises(ValueError, match="it failed"):
            bench.check_tasks()
        bench.check_tasks()
        with pytest.raises(ValueError, match="it failed"):
            task.result()


def test_a_traceback_ends_where_the_result_is_read() -> None:
    with Bench(Rrc()) as bench:
        task = bench.start(bench.sleep("1s"))
        with pytest.raises(RuntimeError, match="not ended yet") as info:
            task.result()
    assert str(info.traceback.filter(info)[-1].path).endswith("test_tasks.py")


def test_a_task_that_has_not_ended_names_the_line_that_it_waits_for() -> None:
    async def body(bench: Bench) -> None:
        await bench.until(bench.on_line("OK:*", nth=3))

    with Bench(Rrc()) as bench, pytest.raises(RuntimeError, match=r"py:\d+ for the 3rd OK:\*$"):
        bench.start(body(bench)).result()


def test_what_is_no_wait_of_a_bench_is_told() -> None:
    async def body() -> None:
        await asyncio.sleep(0)

    with Bench(Rrc()) as bench, pytest.raises(TypeError, match=r"waits for bench\.sleep"):
        bench.run(body())


def test_who_asks_for_the_loop_of_asyncio_is_told_what_to_do() -> None:
    async def body() -> None:
        await asyncio.sleep(1)

    told = r"no running event loop: .*waits for bench\.sleep"
    with Bench(Rrc()) as bench:
        with pytest.raises(RuntimeError, match=told):
            bench.run(body())
        with pytest.raises(RuntimeError, match=told):
            bench.start(body()).result()


def test_what_never_comes_is_told() -> None:
    async def body(bench: Bench) -> None:
        await bench.until(lambda: False)

    with Bench(Rrc()) as bench:
        with pytest.raises(RuntimeError, match="nothing will ever happen"):
            bench.run(body(bench))
        assert bench.now_us < 10_000_000  # it ends with what happened last


def test_a_day_counts_from_the_begin_of_the_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    assert tasks.DAY_US == 24 * 3_600 * 1_000_000
    for module in (tasks, virtual_mode):
        monkeypatch.setattr(module, "DAY_US", 10_000_000)

    async def body(bench: Bench) -> None:
        await bench.until(lambda: False)

    with Bench(Rrc()) as bench:
        bench.run_for("6s")
        with pytest.raises(RuntimeError, match="nothing will ever happen"):
            bench.run(body(bench))


def test_what_has_not_come_in_a_day_is_waited_for_no_longer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in (tasks, virtual_mode):  # a whole day of a URG takes seconds
        monkeypatch.setattr(module, "DAY_US", 10_000_000)

    async def body(bench: Bench) -> None:
        await bench.until(lambda: False)

    with Bench("urg") as bench:
        with pytest.raises(RuntimeError, match=r"test_tasks\.py:\d+ .* in a day .*within="):
            bench.run(body(bench))
        assert bench.now_us == 10_000_000


def test_ctrl_c_says_what_a_body_waits_for_and_the_time() -> None:
    def interrupted() -> bool:
        if bench.now_us >= 2_000_000:
            raise KeyboardInterrupt
        return False

    async def body(bench: Bench) -> None:
        await bench.until(interrupted, within="100s")

    with (
        Bench(Rrc()) as bench,
        pytest.raises(KeyboardInterrupt, match=r"^2\.0\d* s old, waiting for .* test_tasks\.py:"),
    ):
        bench.run(body(bench))

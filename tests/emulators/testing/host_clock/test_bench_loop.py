"""Hosts of asyncio live in the time of a rig."""

from __future__ import annotations

import asyncio
import socket
import threading

import pytest
import serial
import serial_asyncio_fast

from tests.emulators.testing.host_clock.test_patched_time import RrcBench
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.modes.virtual_mode import RigPassing
from tickrig.emulators.testing.host_clock.patched_time import patched_time


def test_sleeping_and_timeouts_are_those_of_the_rig() -> None:
    bench = RrcBench()

    async def host() -> list[str]:
        loop, said = asyncio.get_running_loop(), list[str]()
        begin = loop.time()
        loop.call_later(1.5, said.append, "later")
        await asyncio.gather(asyncio.sleep(1), asyncio.sleep(3600))
        assert loop.time() - begin == pytest.approx(3600, abs=1e-5)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 0.25)
        async with asyncio.timeout(5):
            await asyncio.sleep(0)
        return said

    with patched_time(bench.passing):
        assert asyncio.run(host()) == ["later"]
    assert 0 <= bench.rig.now_us - 3_600_250_000 <= 10


def test_many_timers_keep_their_times() -> None:
    bench, said = RrcBench(), list[tuple[int, int]]()

    async def beat(number: int) -> None:
        for _ in range(20):
            await asyncio.sleep(0.001 * number + 1e-7)
            said.append((bench.rig.now_us, number))

    async def host() -> None:
        await asyncio.gather(*(beat(number) for number in range(1, 8)))

    with patched_time(bench.passing):
        asyncio.run(host())
    assert said == sorted(said, key=lambda each: each[0])
    assert 140_000 <= said[-1][0] <= 140_100


def test_what_happens_on_the_bench_wakes_it() -> None:
    bench = RrcBench()

    async def host() -> int:
        answer: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        bench.rig.event_queue.put("x", 70_000, answer.set_result)
        return await answer

    with patched_time(bench.passing):
        assert asyncio.run(host()) == 70_000
    assert bench.rig.now_us <= 70_000


def test_a_loop_waits_for_its_threads_while_no_virtual_time_passes() -> None:
    bench = RrcBench()

    async def host() -> list[int]:
        loop = asyncio.get_running_loop()
        return [await loop.run_in_executor(None, pow, 2, 5), await asyncio.to_thread(pow, 2, 6)]

    with patched_time(bench.passing):
        assert asyncio.run(host()) == [32, 64]
    assert bench.rig.now_us == 0


def test_a_serial_host_of_asyncio_is_told_to_run_in_real_time() -> None:
    line = SerialLine()
    rig = Rig(Station(Rrc(), line.a))

    async def host() -> None:
        url = "tickrig://asyncio"
        await serial_asyncio_fast.open_serial_connection(url=url, baudrate=115_200)

    with (
        SERIAL_PORTS.offer("asyncio", SerialSide(rig, line.b)),
        patched_time(RigPassing(rig)),
        pytest.raises(serial.SerialException, match="run in real time: --bench-mode real"),
    ):
        asyncio.run(host())


def test_what_will_never_come_is_told() -> None:
    async def host() -> None:
        await asyncio.Event().wait()

    with (
        patched_time(RrcBench().passing),
        pytest.raises(RuntimeError, match="an event loop waits endlessly"),
        asyncio.Runner() as runner,
    ):
        runner.run(host())


def test_sockets_of_the_same_loop_work() -> None:
    bench = RrcBench()
    near, far = socket.socketpair()

    async def host() -> bytes:
        reader, writer = await asyncio.open_connection(sock=near)
        other, answering = await asyncio.open_connection(sock=far)
        writer.write(b"hello\n")
        answering.write(await other.readline())
        line = await reader.readline()
        for each in (writer, answering):
            each.close()
            await each.wait_closed()
        return line

    with patched_time(bench.passing):
        assert asyncio.run(host()) == b"hello\n"
    assert bench.rig.now_us == 0


def test_afterwards_and_in_other_threads_loops_are_as_ever() -> None:
    kinds: list[type] = []

    def other() -> None:
        loop = asyncio.new_event_loop()
        kinds.append(type(loop))
        loop.close()

    original = asyncio.new_event_loop
    with patched_time(RrcBench().passing):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        other()
    other()
    assert [kind.__name__ == "_BenchLoop" for kind in kinds] == [False, True, False]
    assert asyncio.new_event_loop is original

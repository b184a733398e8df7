"""A host that polls for ever ends with an error, at the same virtual time in each run."""

from __future__ import annotations

import asyncio
import inspect
import re
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import can
import canopen
import pytest
import serial
from canopen.nmt import NmtError

from tickrig import Bench, open_bench
from tickrig.device import Rrc, make_f_palette
from tickrig.emulators.rig.sim_waits import MOST_LOOKS
from tickrig.emulators.testing.bench.modes import virtual_mode
from tickrig.emulators.testing.host_clock import bench_loop
from tickrig.emulators.testing.host_clock.host_code import HostHangsError
from tickrig.host.links.link import LinkError
from tickrig.testing import conformance
from tickrig.wire.can import CanFrame

HEARTBEATS = (CanFrame.parse("605#2B17100064000000"),)
"""Node 5 sends one each 100 ms from now on."""


def read(bench: Bench) -> object:
    port = bench.serial(timeout=0.5)
    while True:
        port.read()


def read_lines(bench: Bench) -> object:
    with serial.serial_for_url(bench.url, timeout=0.5) as port:
        while True:
            port.readline()


def send_breaks(bench: Bench) -> object:
    port = bench.serial(timeout=0.5)
    while True:
        port.send_break()


def receive(bench: Bench) -> object:
    link = bench.link
    while True:
        link.receive(500_000)


def sleep(bench: Bench) -> object:
    with bench.patched_time():
        while True:
            time.sleep(0.5)


def sleep_in_asyncio(bench: Bench) -> object:
    async def poll() -> None:
        while True:
            await asyncio.sleep(0.5)

    with bench.patched_time():
        asyncio.run(poll())
    raise AssertionError


def recv(bench: Bench) -> object:
    with bench.can_bus() as bus:
        while True:
            bus.recv(0.5)


def recv_without_a_time_out(bench: Bench) -> object:
    bench.run_for("100ms")
    bench.link.send(HEARTBEATS)
    with bench.can_bus(can_filters=[{"can_id": 0x123, "can_mask": 0x7FF}]) as bus:
        return bus.recv()


def ask_for_an_answer(bench: Bench) -> object:
    node: Any = bench.canopen_network().add_node(9, None)
    while True:
        try:
            return node.sdo.upload(0x1000, 0)
        except canopen.SdoCommunicationError:
            pass


def wait_for_a_heartbeat(bench: Bench) -> object:
    node: Any = bench.canopen_network().add_node(9, None)
    while True:
        try:
            return node.nmt.wait_for_heartbeat(timeout=1)
        except NmtError:
            pass


def await_by_steps(bench: Bench) -> object:
    async def wait_a_little() -> None:
        await bench.sleep("500ms")

    async def poll() -> None:
        while True:
            await wait_a_little()

    return bench.run(poll())


ON_A_LINE = (read, read_lines, send_breaks, receive, sleep, sleep_in_asyncio, await_by_steps)
ON_A_BUS = (recv, recv_without_a_time_out, ask_for_an_answer, wait_for_a_heartbeat, receive)
HOSTS = [(Rrc, host) for host in ON_A_LINE] + [(partial(make_f_palette, 5), h) for h in ON_A_BUS]


def hanging(bench: Bench, host: Callable[[Bench], object]) -> str:
    with bench, pytest.raises(HostHangsError) as caught:
        host(bench)
    return str(caught.value)


@pytest.mark.parametrize(
    ("device", "host"), HOSTS, ids=[f"{host.__name__}-{n}" for n, (_, host) in enumerate(HOSTS)]
)
def test_a_host_that_polls_for_ever_is_ended(
    device: Callable[[], Any], host: Callable[[Bench], object]
) -> None:
    benches = [Bench(device(), limit="60s") for _ in range(2)]
    text, again = (hanging(bench, host) for bench in benches)
    lines, first = inspect.getsourcelines(host)
    file, _, rest = text.partition(":")
    line, _, _ = rest.partition(":")
    assert file.endswith("test_wait_limit.py")
    assert first < int(line) < first + len(lines)
    assert ": the host has waited for 60.000000 s of virtual time" in text
    now_us = benches[0].now_us
    assert f", up to {now_us / 1e6:.6f} s, " in text
    assert ", and the test has called neither" in text
    assert 'Bench(..., limit="7200s"), --bench-limit 7200s, or bench_limit' in text
    assert 60_000_000 <= now_us < 65_000_000
    assert again == text


def test_an_hour_is_the_limit_of_a_host_unless_another_is_given(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text('[device.one]\ntype = "f-palette"\nnode_id = 5\n')
    for bench, limit_us in (
        (Bench(make_f_palette(5)), 3_600_000_000),
        (open_bench(path), 3_600_000_000),
        (open_bench(path, limit="60s"), 60_000_000),
        (Bench(make_f_palette(5), limit=30_000_000), 30_000_000),
    ):
        hanging(bench, recv)
        assert limit_us <= bench.now_us < limit_us + 1_000_000


@pytest.mark.parametrize("limit", [0, "0", "none"])
def test_without_a_limit_a_host_may_wait(limit: int | str) -> None:
    with Bench(make_f_palette(5), limit=limit) as bench, bench.can_bus() as bus:
        for _ in range(1_200):
            bus.recv(10)
        assert bench.now_us > 1_000_000_000
        bench.run_for("1s")


def test_a_limit_that_is_not_a_time_is_refused() -> None:
    with pytest.raises(ValueError, match="'60' has no unit: write 60s"):
        Bench(Rrc(), limit="60")


def poll(bus: can.BusABC, until: Callable[[], bool]) -> None:
    while not until():
        bus.recv(0.1)


def never() -> bool:
    return False


def test_calls_of_the_test_begin_the_limit_again() -> None:
    with Bench(make_f_palette(5), limit="10s") as bench, bench.can_bus() as bus:
        network: Any = bench.canopen_network()
        advances: list[Callable[[], object]] = [
            lambda: bench.run_for("20s"),
            lambda: bench.wait_until(never, within="20s"),
            lambda: network.run_for(20_000_000),
        ]
        for advance in advances:
            advance()
            until_us = bench.now_us + 9_000_000
            poll(bus, lambda at_us=until_us: bench.now_us >= at_us)  # type: ignore[misc]
        with pytest.raises(HostHangsError):
            poll(bus, never)
        bench.run_for("1s")
        bus.recv(0.1)


def test_a_few_long_waits_are_no_polling() -> None:
    async def body(bench: Bench) -> None:
        for _ in range(10):
            await bench.sleep("7200s")

    with Bench(make_f_palette(5)) as bench, bench.can_bus() as bus, bench.patched_time():
        for _ in range(10):
            bus.recv(7_200)
            time.sleep(7_200)
        bench.run(body(bench))
        assert bench.now_us > 200_000_000_000


def test_a_wait_that_hears_other_frames_is_one_wait() -> None:
    with Bench(make_f_palette(5), limit="120s") as bench, bench.can_bus() as bus:
        bench.run_for("100ms")
        bus.set_filters([{"can_id": 0x123, "can_mask": 0x7FF}])
        network: Any = bench.canopen_network()
        bench.link.send(HEARTBEATS)
        assert bus.recv(150) is None
        assert not network.wait(lambda: False, 150)
        with pytest.raises(HostHangsError):
            bus.recv(150)


def wait_for(bit: int, bus: can.BusABC) -> None:
    while not ask(bus) & bit:
        pass


def ask(bus: can.BusABC) -> int:
    bus.recv(0.1)
    return 0


def test_the_lines_that_called_the_waiting_line_are_named() -> None:
    with (
        Bench(make_f_palette(5), limit="10s") as bench,
        bench.can_bus() as bus,
        pytest.raises(HostHangsError) as caught,
    ):
        wait_for(1, bus)
    lines = [
        inspect.getsourcelines(each)[1] + after
        for each, after in (
            (ask, 1),
            (wait_for, 1),
            (test_the_lines_that_called_the_waiting_line_are_named, 6),
        )
    ]
    waits, loops, test = (rf"[^ ,:]*test_wait_limit\.py:{line}" for line in lines)
    called = rf"{waits}: the host .*, called from {loops}, {test}, and the"
    assert re.match(called, str(caught.value)), str(caught.value)


def read_clock() -> None:
    while time.monotonic() > 0:
        pass


def test_a_host_that_only_reads_the_clock_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_mode, "_MOST_LOOKS", 2_000)
    with Bench(Rrc()) as bench, bench.patched_time():
        for _ in range(3):
            for _ in range(1_500):
                time.monotonic()
            bench.run_for("1ms")
        with pytest.raises(HostHangsError, match=r"limit\.py:\d+: .* read the clock 2000 times, "):
            read_clock()


def test_a_body_that_awaits_no_time_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    async def body(bench: Bench) -> None:
        while True:
            await bench.sleep("0s")

    monkeypatch.setattr(virtual_mode, "_MOST_LOOKS", 2_000)
    with (
        Bench(Rrc()) as bench,
        pytest.raises(HostHangsError, match=r"limit\.py:\d+: .* awaited 0 s 2000 times, "),
    ):
        bench.run(body(bench))


def read_whatever_is_raised(port: Any, errors: list[Exception]) -> None:
    while True:
        try:
            port.read()
        except Exception as error:
            errors.append(error)


def test_a_host_that_catches_the_error_is_ended_too() -> None:
    errors: list[Exception] = []
    with Bench(Rrc(), limit="10s") as bench, pytest.raises(BaseException, match="limit") as caught:
        read_whatever_is_raised(bench.serial(timeout=0.1), errors)
    assert not isinstance(caught.value, Exception)
    assert str(caught.value) == str(errors[0])
    assert len(errors) == 100


def test_what_ends_a_test_may_wait_after_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_mode, "_MOST_LOOKS", 2_000)
    monkeypatch.setattr(virtual_mode, "_MORE_LOOKS", 10)
    with Bench(make_f_palette(5), limit="90s") as bench, bench.patched_time():
        with bench.can_bus() as bus:
            for _ in range(2):
                with pytest.raises(HostHangsError):
                    poll(bus, never)
                raised_us = bench.now_us
                poll(bus, lambda: bench.now_us > raised_us + 59_000_000)  # noqa: B023 - called here
        bench.run_for("1s")
        for _ in range(2):
            with pytest.raises(HostHangsError):
                read_clock()
            for _ in range(9):
                time.monotonic()


def test_a_fork_and_a_restored_bench_have_the_limit() -> None:
    def polled_us(bench: Bench) -> int:
        before_us = bench.now_us
        with bench.can_bus() as bus, pytest.raises(HostHangsError):
            poll(bus, never)
        return bench.now_us - before_us

    with Bench(make_f_palette(5), limit="10s") as bench:
        bench.run_for("1s")
        warm = bench.snapshot()
        with bench.fork() as fork:
            took_us = polled_us(fork)
        assert 10_000_000 <= took_us < 11_000_000
        for _ in range(2):
            assert polled_us(bench) == took_us
            assert bench._mode.hung()
            warm.restore()
            assert not bench._mode.hung()


def test_a_link_that_is_only_looked_at_is_ended() -> None:
    with Bench(Rrc()) as bench:
        link = bench.link
        for _ in range(MOST_LOOKS):
            assert not link.receive(0)
        with pytest.raises(LinkError, match=r"looked 10000 times at 0\.000000 s: .*; receive with"):
            link.receive(0)


def test_the_limit_is_not_that_of_the_conformance_tester() -> None:
    with Bench(make_f_palette(5), limit="1s") as bench:
        assert conformance(bench, only="NMT").exit_status == 0
        assert bench.now_us > 3_000_000
        with bench.can_bus() as bus, pytest.raises(HostHangsError):
            poll(bus, never)


def test_a_test_that_only_asks_the_bench_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def wait_for(bench: Bench, state: str) -> None:
        while bench.get("state") != state:
            pass

    monkeypatch.setattr(virtual_mode, "_MOST_GETS", 2_000)
    with Bench(Rrc()) as bench:
        for _ in range(3):
            for _ in range(1_500):
                bench.get("state")
            bench.run_for("1ms")
        with pytest.raises(HostHangsError, match=r"limit\.py:\d+: .* the bench 2000 times at one "):
            wait_for(bench, "Ready")


def test_a_task_that_awaits_no_time_is_ended() -> None:
    async def spin(bench: Bench) -> None:
        while True:
            await bench.sleep(0)

    with Bench(Rrc()) as bench:
        bench.run_for("1s")
        task = bench.start(spin(bench))
        bench.run_for("1s")
        assert task.done
        with pytest.raises(HostHangsError, match=r"limit\.py:\d+: looked 10000 times at 1\.00"):
            bench.check_tasks()


def test_an_event_loop_that_sleeps_for_no_time_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    async def spin() -> None:
        while True:
            await asyncio.sleep(0)

    async def sleep_and_spin() -> None:
        for _ in range(5):
            for _ in range(900):
                await asyncio.sleep(0)
            await asyncio.sleep(1)
        await asyncio.gather(asyncio.sleep(5), spin())

    monkeypatch.setattr(bench_loop, "_MOST_SPINS", 1_000)
    refused = r"limit\.py:\d+, .*limit\.py:\d+: the event loop has run 1000 times at 5\.0"
    with (
        Bench(Rrc()) as bench,
        bench.patched_time(),
        pytest.raises(HostHangsError, match=refused),
    ):
        asyncio.run(sleep_and_spin())

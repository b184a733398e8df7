"""Hosts that look at the clock live in the time of a rig, and nobody else does."""

from __future__ import annotations

import queue
import re
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, suppress
from types import ModuleType

import freezegun
import pytest
import time_machine

from tests.emulators.sim_bench import SimBench
from tests.emulators.testing.host_clock import user_host
from tests.emulators.testing.host_clock.user_host import Host
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.sim_waits import EPOCH_S
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.modes.virtual_mode import RigPassing
from tickrig.emulators.testing.host_clock.host_code import HostTimeError
from tickrig.emulators.testing.host_clock.patched_time import patched_time


class LinkPort:
    """A port of pyserial with `timeout=0`, as far as the host uses it, on a rig."""

    def __init__(self, link: SimLink) -> None:
        self._link = link

    def read(self, size: int = 1) -> bytes:
        return self._link.receive(0)

    def write(self, data: bytes) -> int:
        self._link.send(data)
        return len(data)


class RrcBench:
    def __init__(self) -> None:
        line = SerialLine()
        self.rrc = Rrc()
        self.rig = Rig(Station(self.rrc, line.a))
        self.port = LinkPort(SimLink(self.rig, line.b))
        self.passing = RigPassing(self.rig)

    def power_on(self, now_us: int) -> None:
        self.rrc.inputs.set("power_button", 1)


@pytest.fixture
def bench() -> RrcBench:
    return RrcBench()


@pytest.fixture
def in_virtual_time(bench: RrcBench) -> Iterator[RrcBench]:
    with patched_time(bench.passing):
        yield bench


def test_a_host_with_a_deadline_of_its_own_gets_its_answer(in_virtual_time: RrcBench) -> None:
    host = Host(in_virtual_time.port)
    in_virtual_time.rig.run_for(500_000)
    assert host.poll() == "EV:Initialized"
    assert host.ask("device") == "OK:device"
    assert in_virtual_time.rig.now_us < 700_000


def test_its_timeout_is_that_of_virtual_time(in_virtual_time: RrcBench) -> None:
    host, rig = Host(in_virtual_time.port), in_virtual_time.rig
    in_virtual_time.rrc.inputs.set("rrc_power", 0)
    begin_us = rig.now_us
    with pytest.raises(TimeoutError):
        host.ask("device", 30.0)
    assert 0 <= rig.now_us - begin_us - 30_000_000 < 2_000


def test_a_loop_that_only_looks_ends(in_virtual_time: RrcBench) -> None:
    assert 4_998 <= Host(in_virtual_time.port).spin(0.5) <= 5_001
    assert 500_000 <= in_virtual_time.rig.now_us < 501_000


def test_what_the_host_has_kept_is_patched_too(in_virtual_time: RrcBench) -> None:
    host = Host(in_virtual_time.port)  # the default of `pause` is patched
    user_host.nap(1.0)
    assert in_virtual_time.rig.now_us == 1_000_000
    assert host.rest(10.0) == pytest.approx(10.0001, abs=1e-6)
    assert Host.stamp() == pytest.approx(EPOCH_S + in_virtual_time.rig.now_us / 1e6, abs=1e-3)
    first, second = user_host.now_ns(), user_host.now_ns()
    assert second[0] - first[0] == second[1] - first[1] == second[2] - first[2] == 300_000


def test_everything_is_as_before_afterwards(bench: RrcBench) -> None:
    kept = (time.sleep, time.monotonic, threading.Event.wait, queue.Queue.get, select.select)
    names, defaults = dict(vars(user_host)), Host.__init__.__defaults__
    with patched_time(bench.passing):
        assert time.sleep is not kept[0]
        assert vars(user_host)["monotonic"] is not names["monotonic"]
        sleep = time.sleep
    with pytest.raises(ZeroDivisionError), patched_time(bench.passing):
        _ = 1 / 0
    assert (time.sleep, time.monotonic, threading.Event.wait) == kept[:3]
    assert (queue.Queue.get, select.select) == kept[3:]
    assert (dict(vars(user_host)), Host.__init__.__defaults__) == (names, defaults)
    assert (Host.now, vars(Host)["stamp"]) == (time.monotonic, time.time)
    before_us = bench.rig.now_us
    sleep(0.0)  # who has kept it has the real one
    assert bench.rig.now_us == before_us


def test_a_module_that_is_imported_meanwhile(in_virtual_time: RrcBench) -> None:
    module = ModuleType("late_host")
    code = "from time import sleep\ndef nap():\n    import time\n    sleep(2)\n    time.sleep(3)\n"
    exec(compile(code, "/home/me/late_host.py", "exec"), vars(module))
    module.nap()
    assert in_virtual_time.rig.now_us == 5_000_000


@pytest.mark.parametrize("name", ["pluggy", "queue", "tickrig.host.control.clock", "serial.x"])
def test_others_have_the_clock_of_the_machine(name: str, in_virtual_time: RrcBench) -> None:
    module = ModuleType(name)
    file = queue.__file__ if name == "queue" else "/x.py"
    exec(compile("import time\ndef now(): return time.time()", file, "exec"), vars(module))
    assert module.now() > EPOCH_S + 20 * 365 * 86_400
    assert in_virtual_time.rig.now_us == 0


def test_sleeping_a_wrong_time_is_refused_as_ever(in_virtual_time: RrcBench) -> None:
    with pytest.raises(ValueError, match="non-negative"):
        time.sleep(-1)
    time.sleep(0)
    assert in_virtual_time.rig.now_us == 100


def test_a_select_of_nothing_is_a_sleep(in_virtual_time: RrcBench) -> None:
    assert select.select([], [], [], 1.5) == ([], [], [])
    assert in_virtual_time.rig.now_us == 1_500_000
    near, far = socket.socketpair()
    with near, far:
        near.send(b"x")
        assert select.select([far], [], [], 5) == ([far], [], [])
    assert in_virtual_time.rig.now_us == 1_500_000


def test_events_are_waited_for_in_virtual_time(in_virtual_time: RrcBench) -> None:
    event, rig = threading.Event(), in_virtual_time.rig
    rig.event_queue.put("set", 250_000, lambda now_us: event.set())
    assert not user_host.wait_for_event(event, 0.2)
    assert rig.now_us == 200_000
    assert user_host.wait_for_event(event, None)
    assert 249_999 <= rig.now_us <= 250_000
    event.clear()
    with pytest.raises(RuntimeError) as caught:
        user_host.wait_for_event(event, None)
    assert re.fullmatch(
        r"tests/.*/user_host\.py:\d+: Event\.wait waits endlessly: nothing that happens on the"
        r" bench ends it, and another thread cannot",
        str(caught.value),
    )


def test_conditions_and_queues_too(in_virtual_time: RrcBench) -> None:
    condition, items, rig = threading.Condition(), queue.Queue[int](1), in_virtual_time.rig

    def put(now_us: int) -> None:
        with condition:
            condition.notify()
        if items.empty():
            items.put_nowait(now_us)

    def take(now_us: int) -> None:
        items.get_nowait()

    for number, action in enumerate((put, put, take)):
        rig.event_queue.put(number, 100_000 * (number + 1), action)
    with condition:
        assert condition.wait(5.0)
        assert not condition.wait(0.05)
    assert items.get(timeout=5.0) == 100_000
    with pytest.raises(queue.Empty):
        items.get(timeout=0.01)
    assert items.get(timeout=5.0) == 200_000
    items.put(1)
    items.put(2, timeout=1.0)
    assert 299_999 <= rig.now_us <= 300_000
    with pytest.raises(queue.Full):
        items.put(3, timeout=0.5)
    assert items.get(block=False) == 2
    with pytest.raises(queue.Empty):
        items.get(block=False)
    with condition:
        assert condition.wait_for(lambda: rig.now_us >= 900_000, 5.0)
        assert not condition.wait_for(lambda: False, 0.5)
    with pytest.raises(RuntimeError, match=r"un-acquired|unlocked|un-owned"):
        condition.wait(0.1)


def test_another_thread_that_waits_is_told_so(bench: RrcBench) -> None:
    watchdog = user_host.Watchdog()

    def run() -> None:
        watchdog.start()
        watchdog.join()

    with pytest.raises(HostTimeError) as caught, patched_time(bench.passing):
        run()
    assert re.fullmatch(
        r"tests/.*/user_host\.py:\d+: time\.sleep: only the thread of the test makes virtual time"
        r" pass, not 'watchdog': run a host with threads in real time",
        str(watchdog.error),
    )
    assert str(caught.value) == str(watchdog.error)
    assert watchdog.looked == EPOCH_S
    assert bench.rig.now_us == 0


def test_threads_that_run_already_keep_their_time(bench: RrcBench) -> None:
    go, ended, seen = threading.Event(), threading.Event(), []

    def other() -> None:
        go.wait()
        time.sleep(0)
        seen.append(time.time())
        ended.set()

    thread = threading.Thread(target=other)
    thread.start()
    with patched_time(bench.passing):
        go.set()
        thread.join()
    assert ended.is_set()
    assert seen[0] > EPOCH_S + 20 * 365 * 86_400
    assert bench.rig.now_us == 0


def test_what_is_called_back_may_look_but_not_wait(bench: RrcBench) -> None:
    said: list[object] = []

    def called_back(now_us: int) -> None:
        said.append(time.time() - EPOCH_S)
        with suppress(RuntimeError):
            time.sleep(1)
        said.append(bench.rig.now_us)

    bench.rig.event_queue.put("x", 50_000, called_back)
    with (
        pytest.raises(HostTimeError, match="what is called back while time passes cannot wait"),
        patched_time(bench.passing),
    ):
        time.sleep(0.2)
    assert said == [pytest.approx(0.05, abs=2e-6), 49_999]


@pytest.mark.parametrize("own", [True, False])
def test_a_network_calls_back_while_its_host_sleeps(own: bool) -> None:
    sim, seen = SimBench(), list[int]()
    sim.network.subscribe(0x705, lambda can_id, data, stamp: seen.append(data[0]))
    with patched_time(sim.network if own else RigPassing(sim.rig)):
        time.sleep(0.1)
    assert seen[0] == 0


def test_a_callback_that_sleeps_is_told_so_though_the_library_swallows_it() -> None:
    bench = SimBench()
    bench.network.subscribe(0x705, lambda can_id, data, stamp: user_host.nap(0.25))
    with (
        pytest.raises(HostTimeError, match=r"user_host\.py:\d+: time\.sleep: what is called back"),
        patched_time(RigPassing(bench.rig)),
    ):
        time.sleep(0.1)


def test_it_costs_nothing_where_nobody_looks(bench: RrcBench) -> None:
    with patched_time(bench.passing) as clock:
        clock.sleep(1)
    assert bench.rig.now_us == 1_000_000


OTHER_CLOCKS: dict[str, Callable[[], AbstractContextManager[object]]] = {
    "freezegun": lambda: freezegun.freeze_time("2020-01-01", ignore=["tickrig"]),
    "time-machine": lambda: time_machine.travel(1_577_836_800, tick=False),
}


@pytest.mark.parametrize("package", OTHER_CLOCKS)
def test_another_clock_is_refused_before_and_while_time_is_patched(
    package: str, bench: RrcBench
) -> None:
    other = OTHER_CLOCKS[package]
    refused = f"{package} has replaced the clock, and so does bench_time"
    with other(), pytest.raises(HostTimeError, match=refused), patched_time(bench.passing):
        pass
    with pytest.raises(HostTimeError, match=refused), patched_time(bench.passing), other():
        time.sleep(0.001)
    with patched_time(bench.passing):
        time.sleep(0.001)

"""A host that looks at the clock of the machine in a virtual test is found, and nobody else."""

from __future__ import annotations

import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import serial

from tests.emulators.testing.host_clock import user_host
from tests.emulators.testing.host_clock.test_patched_time import RrcBench
from tests.emulators.testing.host_clock.user_host import Host
from tests.host.live import pty
from tickrig.emulators.testing.host_clock.host_code import UnpatchedTimeError
from tickrig.emulators.testing.host_clock.patched_time import patched_time, unpatched_time_fails
from tickrig.host.control.clock import RealClock

WHAT_TO_DO = (
    "in virtual time the clock of this machine means nothing: take the fixture bench_time, or wait"
    """ by bench.run_for or bench.sleep, or mark the test needs("real or hardware")"""
)


def module_of(name: str, file: str, code: str) -> Any:
    module = ModuleType(name)
    exec(compile(code, file, "exec"), vars(module))
    return module


def test_what_a_module_keeps_later_is_found_too(monkeypatch: pytest.MonkeyPatch) -> None:
    late = module_of("late_host", "/home/me/late_host.py", "def rest(): nap(1)")
    monkeypatch.setitem(sys.modules, "late_host", late)
    late.__file__ = "/home/me/late_host.py"
    with unpatched_time_fails():
        pass
    late.nap = time.sleep
    with (
        pytest.raises(UnpatchedTimeError, match=r"late_host\.py:1: time\.sleep is called"),
        unpatched_time_fails(),
    ):
        late.rest()
    assert late.nap is time.sleep


def test_a_module_in_the_place_of_another_is_found_too(monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(2):
        code = "from time import sleep\ndef rest(): sleep(1)"
        host = module_of("new_host", "/home/me/new_host.py", code)
        host.__file__ = "/home/me/new_host.py"
        monkeypatch.setitem(sys.modules, "new_host", host)
        with pytest.raises(UnpatchedTimeError), unpatched_time_fails():
            host.rest()


def test_the_line_is_told_and_what_to_do() -> None:
    bench = RrcBench()
    with pytest.raises(UnpatchedTimeError) as caught, unpatched_time_fails():
        Host(bench.port).ask("device")
    source = Path(user_host.__file__).read_text("utf-8")
    line = source[: source.index("deadline = monotonic()")].count("\n") + 1
    place = f"tests/emulators/testing/host_clock/user_host.py:{line}"
    assert str(caught.value) == f"{place}: time.monotonic is called, but {WHAT_TO_DO}"


@pytest.mark.parametrize(
    ("look", "name"),
    [
        (lambda: Host(RrcBench().port).rest(1.0), "sleep"),
        (lambda: Host(RrcBench().port).spin(1.0), "monotonic"),
        (user_host.now_ns, "time_ns"),
        (lambda: Host.stamp() > 0, "time"),
    ],
)
def test_each_way_to_it_is_found(look: Any, name: str) -> None:
    with (
        pytest.raises(UnpatchedTimeError, match=rf":\d+: time\.{name} is called, but"),
        unpatched_time_fails(),
    ):
        look()


def swallow() -> None:
    """Be a host that tries again and again."""
    with suppress(Exception):
        time.sleep(3)


def test_a_host_that_swallows_it_does_not_hide_it() -> None:
    with (
        pytest.raises(UnpatchedTimeError, match=r"\.py:\d+: time\.sleep is called"),
        unpatched_time_fails(),
    ):
        swallow()


def test_within_patched_time_all_is_well() -> None:
    bench = RrcBench()
    with unpatched_time_fails(), patched_time(bench.passing):
        assert Host(bench.port).rest(2.0) > 1.9
    with patched_time(bench.passing), unpatched_time_fails():
        assert Host(bench.port).rest(2.0) > 1.9


def test_behind_patched_time_it_is_refused_again() -> None:
    bench = RrcBench()

    def both() -> None:
        with patched_time(bench.passing):
            time.sleep(1)
        time.sleep(1)

    with pytest.raises(UnpatchedTimeError), unpatched_time_fails():
        both()
    assert bench.rig.now_us == 1_000_000


def test_what_fails_otherwise_stays_what_it_is() -> None:
    def fail() -> None:
        swallow()
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as failed, unpatched_time_fails():
        fail()
    (note,) = failed.value.__notes__
    assert "time.sleep is called, but" in note


def test_what_fails_by_itself_has_no_note() -> None:
    with pytest.raises(ZeroDivisionError) as failed, unpatched_time_fails():
        raise ZeroDivisionError
    assert not hasattr(failed.value, "__notes__")


def test_nobody_else_is_refused() -> None:
    with unpatched_time_fails():
        assert time.perf_counter() > 0
        assert RealClock().wait_until(1) >= 0
        assert not threading.Event().wait(0.0)
        library = module_of(
            "stamps", "/x/site-packages/stamps.py", "import time\ndef now(): return time.time()"
        )
        assert library.now() > 0


def test_an_installed_host_may_stamp_but_not_wait() -> None:
    code = "import time\ndef nap(): time.sleep(1)\ndef now(): return time.monotonic()"
    library = module_of("a_host.link", "/x/site-packages/a_host/link.py", code)
    for call in (library.nap, library.now):
        with (
            pytest.raises(
                UnpatchedTimeError, match=r"^/x/site-packages/a_host/link\.py:\d: time\."
            ),
            unpatched_time_fails(),
        ):
            call()
    with unpatched_time_fails(allowed=["a_host"]):
        assert library.now() > 0


def test_threads_that_run_already_are_left_alone() -> None:
    go, seen = threading.Event(), list[float]()

    def other() -> None:
        go.wait()
        seen.append(time.monotonic())

    thread = threading.Thread(target=other)
    thread.start()
    with unpatched_time_fails():
        go.set()
        thread.join()
    assert len(seen) == 1


def test_a_thread_of_the_host_is_found() -> None:
    watchdog = user_host.Watchdog()

    def run() -> None:
        watchdog.start()
        watchdog.join()

    told = r"user_host\.py:\d+: time\.\w+ is called in a thread.*needs\(.real or hardware.\)"
    with pytest.raises(UnpatchedTimeError, match=told), unpatched_time_fails():
        run()
    assert isinstance(watchdog.error, UnpatchedTimeError)


@pytest.mark.realtime
def test_pyserial_has_its_time() -> None:
    with pty() as port, serial.Serial(port.path, timeout=0.01) as real:
        with unpatched_time_fails():
            assert real.read(1) == b""
            assert real.read_until(b"x") == b""
        with patched_time(RrcBench().passing):
            assert real.read(1) == b""

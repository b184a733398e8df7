from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)

HOST = """
import time
from time import monotonic, sleep

def beat(link):
    deadline = monotonic() + 10
    while monotonic() < deadline:
        link.send(b"beep10\\n")
        sleep(1)
"""


def test_a_host_that_sleeps_lives_in_the_time_of_its_bench(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(my_host=HOST)
    pytester.makepyfile(
        """
        import my_host

        def test_beat(bench, bench_time):
            before = bench_time.monotonic()
            my_host.beat(bench.link)
            assert 10_000_000 <= bench.now_us < 11_000_000
            assert 10 <= bench_time.monotonic() - before < 11
        """
    )
    run().assert_outcomes(passed=1)


def test_a_test_that_sleeps_fails_with_the_line(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(my_host=HOST)
    pytester.makepyfile(
        """
        import time
        import pytest
        import my_host

        def test_beat(bench):
            my_host.beat(bench.link)

        def test_nobody_sees_it(bench):
            try:
                time.sleep(0.001)
            except RuntimeError:
                pass

        @pytest.mark.allows("clock")
        def test_it_may(bench):
            time.sleep(0.001)

        def test_without_a_bench():
            time.sleep(0.001)
        """
    )
    result = run()
    result.assert_outcomes(passed=2, failed=2)
    result.stdout.fnmatch_lines(
        [
            ">*deadline = monotonic() + 10",
            "E *UnpatchedTimeError: my_host.py:5: time.monotonic is called, but in virtual time *",
            "",
            "my_host.py:5: UnpatchedTimeError",
            "test_a_*.py:10: time.sleep is called, but in virtual time *",
        ]
    )


def test_a_thread_of_a_fixture_that_sleeps_fails_its_test(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import threading
        import time
        import pytest

        @pytest.fixture
        def host(bench):
            go = threading.Event()
            def work():
                go.wait()
                try:
                    time.sleep(0.001)
                except RuntimeError:
                    pass
            thread = threading.Thread(target=work)
            thread.start()
            yield go, thread
            go.set()

        def test_one(host):
            go, thread = host
            go.set()
            thread.join()
        """
    )
    result = run()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*test_a_*.py:11: time.sleep is called in a thread, *"])


@pytest.mark.parametrize(("mode", "outcome"), [("virtual", "skipped"), ("real", "passed")])
@pytest.mark.realtime
def test_a_test_can_be_marked_as_the_error_says(
    pytester: pytest.Pytester, run: Run, mode: str, outcome: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import time
        import pytest

        @pytest.mark.needs("real or hardware")
        def test_one(bench):
            time.sleep(0.001)
        """
    )
    run("--bench-mode", mode).assert_outcomes(**{outcome: 1})


def test_what_a_test_has_put_in_place_of_the_clock_stays(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(my_host=HOST)
    pytester.makepyfile(
        """
        import time
        import pytest
        import my_host

        def test_first(bench):
            pass

        @pytest.fixture
        def naps(monkeypatch):
            naps = []
            monkeypatch.setattr("my_host.sleep", naps.append)
            monkeypatch.setattr("time.sleep", naps.append)
            return naps

        def test_one(bench, naps):
            my_host.sleep(1)
            time.sleep(2)
            assert naps == [1, 2]

        def test_two(bench, monkeypatch):
            monkeypatch.setattr("my_host.sleep", print)

        def test_three(bench):
            with pytest.raises(RuntimeError, match="test_what_a_test_.*py:.*: time.sleep is"):
                time.sleep(3)
            raise ValueError("here")
        """
    )
    result = run()
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines(["*ValueError: here"])


@pytest.mark.realtime
def test_in_real_time_a_host_keeps_its_clock(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import time

        def test_sleep(bench, bench_time):
            assert bench_time is time
            time.sleep(0.001)
        """
    )
    run("--bench-mode", "real").assert_outcomes(passed=1)


def test_a_wait_that_was_swallowed_is_told_at_the_end_in_a_line(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    file = pytester.makepyfile(
        """
        import threading
        import time

        def beat():
            try:
                time.sleep(1)
            except RuntimeError:
                pass

        def test_beat(bench, bench_time):
            thread = threading.Thread(target=beat)
            thread.start()
            thread.join()
        """
    )
    result = run()
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines([f"{file.name}:6: time.sleep: *"])
    result.stdout.no_fnmatch_line("*patched_time*")

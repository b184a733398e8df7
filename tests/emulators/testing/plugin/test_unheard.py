"""What goes wrong in a host where no assert of the test looks: it fails the test all the same."""

from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)

READER = """
import threading

import serial
from serial.threaded import Protocol, ReaderThread


class Reader(Protocol):
    def connection_lost(self, exc):
        super().connection_lost(exc)


def read(port):
    raise ValueError("no number in b''")


def run(target, *args):
    thread = threading.Thread(target=target, args=args, name="reader")
    thread.start()
    thread.join()
"""


@pytest.fixture(autouse=True)
def project(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(my_host=READER)


def test_a_thread_that_dies_fails_its_test(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import my_host

        def test_one(bench):
            my_host.run(my_host.read, bench)
        """
    )
    result = run("-W", "default")
    result.assert_outcomes(failed=1, warnings=1)
    result.stdout.fnmatch_lines(
        ["thread 'reader' has died at *my_host.py:13: ValueError: no number in b''"]
    )


def test_a_reader_thread_of_pyserial_has_no_virtual_time(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        import my_host

        def test_one(bench):
            thread = my_host.ReaderThread(bench.serial(), my_host.Reader)
            thread.start()
            thread.join()
        """
    )
    result = run("-W", "default")
    result.assert_outcomes(failed=1, warnings=1)
    result.stdout.fnmatch_lines(["thread 'Thread-*' has died at *my_host.py:9: SerialException: *"])


@pytest.mark.usefixtures("recwarn")  # pytest warns when its run is over
def test_a_thread_that_dies_while_fixtures_end_is_an_error(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        import my_host
        import pytest

        @pytest.fixture
        def host(bench):
            yield
            my_host.run(my_host.read, bench)

        def test_one(host):
            pass
        """
    )
    result = run("-W", "default")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["thread 'reader' has died at *my_host.py:13: ValueError: *"])


def test_a_failure_tells_of_threads_that_died_before(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import my_host
        import pytest

        def test_one(bench):
            my_host.run(my_host.read, bench)
            assert bench.now_us

        @pytest.mark.xfail(strict=True)
        def test_two(bench):
            my_host.run(my_host.read, bench)
            assert bench.now_us
        """
    )
    result = run("-W", "default")
    result.assert_outcomes(failed=1, xfailed=1, warnings=2)
    result.stdout.fnmatch_lines(
        [
            ">*assert bench.now_us",
            "*- bench: beside the test -*",
            "thread 'reader' has died at *my_host.py:13: ValueError: no number in b''",
        ]
    )


def test_what_threads_may_do(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import sys
        import threading

        import my_host
        import pytest

        @pytest.mark.allows("threads")
        def test_it_may_die(bench):
            my_host.run(my_host.read, bench)

        def test_it_may_end(bench):
            my_host.run(sys.exit)

        def test_without_a_bench():
            my_host.run(my_host.read, None)

        def test_it_is_of_another_test(bench, old_thread):
            go, thread = old_thread
            go.set()
            thread.join()

        @pytest.fixture(scope="module")
        def old_thread():
            go = threading.Event()
            def work():
                go.wait()
                raise ValueError("late")
            thread = threading.Thread(target=work)
            thread.start()
            return go, thread
        """
    )
    run("-W", "default").assert_outcomes(passed=4, warnings=4)


def test_a_thread_that_ends_with_an_error_has_died(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import sys
        import my_host

        def test_one(bench):
            my_host.run(sys.exit, "the port is gone")
        """
    )
    result = run("-W", "default")
    result.assert_outcomes(failed=1, warnings=1)
    result.stdout.fnmatch_lines(["thread 'reader' has died at *: SystemExit: the port is gone"])


@pytest.mark.realtime
def test_so_it_is_in_real_time(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import my_host

        def test_one(bench):
            bench.run_for("10ms")
            my_host.run(my_host.read, bench)
        """
    )
    result = run("-W", "default", "--bench-mode", "real")
    skip_if_too_slow(result)
    result.assert_outcomes(failed=1, warnings=1)
    result.stdout.fnmatch_lines(["thread 'reader' has died at *my_host.py:13: ValueError: *"])


@pytest.mark.parametrize(
    ("call", "name"),
    [
        ("bench.sleep('1s')", "Bench.sleep"),
        ("bench.edge('state')", "Bench.edge"),
        ("bench.until(lambda: True)", "Bench.until"),
        ("helper(bench)", "helper"),
    ],
)
@pytest.mark.parametrize("filter_", ["default", "ignore"])
def test_what_nobody_awaits_fails_its_test(
    pytester: pytest.Pytester, run: Run, call: str, name: str, filter_: str
) -> None:
    pytester.makepyfile(
        f"""
        async def helper(bench):
            await bench.sleep("1s")

        def test_one(bench):
            {call}

        async def test_two(bench):
            {call}
        """
    )
    result = run("-W", filter_)
    assert result.parseoutcomes()["failed"] == 2
    result.stdout.fnmatch_lines(
        [f"{name} was called and not awaited at test_what_*.py:{line}" for line in (5, 8)]
    )


def test_what_is_awaited_or_run_passes(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import warnings

        async def test_one(bench):
            await bench.sleep("1s")
            task = bench.start(bench.sleep("1s"))
            await task
            warnings.warn("something else")

        def test_two(bench):
            bench.run(bench.sleep("1s"))
        """
    )
    run("-W", "default").assert_outcomes(passed=2, warnings=1)


NEVER = """
def test_one(bench):
    bench.fault("vr2_fault", when=lambda: bench.get("state") == "Nowhere", for_="1s")
    bench.run_for("1s")
"""


def test_a_fault_that_never_began_is_a_warning_of_a_test_that_passed(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(NEVER)
    result = run("-W", "default")
    result.assert_outcomes(passed=1, warnings=1)
    text = "a fault of this test never began: vr2_fault: the condition of *.py:? was never true"
    result.stdout.fnmatch_lines([f"*.py:?: PytestWarning: {text}"])
    run("-W", "error").assert_outcomes(failed=1)


def test_a_fault_that_never_began_is_in_the_report_of_a_failure(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(f"{NEVER}    assert 0\n")
    result = run("-W", "default")
    result.assert_outcomes(failed=1, warnings=0)
    result.stdout.fnmatch_lines(
        ["*bench: faults that never began*", "vr2_fault: the condition of *.py:? was never true"]
    )


def test_a_fault_that_is_cleared_waits_for_nothing(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        def test_one(bench):
            bench.fault("vr2_fault", when=lambda: bench.now_us >= 500_000)
            bench.clear("vr2_fault")
            bench.run_for("1s")
            assert bench.get("vr2_fault") == 0
        """
    )
    run("-W", "error").assert_outcomes(passed=1)

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
            "*my_host.py:5: time.monotonic is called, but in virtual time *",
            "*test_a_*.py:10: time.sleep is called, but in virtual time *",
        ]
    )


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

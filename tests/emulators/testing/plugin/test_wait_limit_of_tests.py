from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)

HOST = """
import time

def wait_for_ready(port):
    while b"ready" not in port.readline():
        pass

def wait_whatever_comes(port):
    while True:
        try:
            wait_for_ready(port)
        except Exception:
            return

def poll(port, count):
    for _ in range(count):
        port.read()
"""


def test_a_host_that_polls_for_ever_fails_its_test_at_its_line(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(my_host=HOST)
    pytester.makepyfile(
        """
        import my_host
        import pytest

        def test_it_polls(bench):
            my_host.wait_for_ready(bench.serial(timeout=1))

        def test_it_catches_everything(bench):
            my_host.wait_whatever_comes(bench.serial(timeout=1))

        async def test_it_awaits(bench):
            while bench.get("state") != "Ready":
                await bench.sleep("10ms")

        @pytest.mark.allows("long waits")
        def test_it_may(bench):
            my_host.poll(bench.serial(timeout=1), 100)
        """
    )
    result = run("--bench-limit", "60s")
    result.assert_outcomes(passed=1, failed=3)
    result.stdout.fnmatch_lines(
        [
            '>*while b"ready" not in port.readline():',
            "E *HostHangsError: my_host.py:4: the host has waited for 60.000000 s of virtual time, "
            "up to 6?.?????? s, called from test_a_host_*.py:5, and the test has called neither "
            "run_for nor wait_until since. Give "
            'the loop a time-out, or raise the limit: Bench(..., limit="7200s"), --bench-limit '
            '7200s, or bench_limit in the configuration file; "none" switches it off',
            "my_host.py:4: HostHangsError",
            "my_host.py:4: the host has waited for 60.000000 s *",
            "E *HostHangsError: test_a_host_*.py:12: the host has waited for 60.000000 s *",
        ]
    )


def test_the_limit_of_a_test_run(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makeini("[pytest]\nbench_limit = 30s\n")
    pytester.makepyfile(my_host=HOST)
    pytester.makepyfile(
        """
        import my_host
        import pytest
        from tickrig.device import Rrc, make_epos

        def test_it_polls(bench):
            my_host.poll(bench.serial(timeout=1), 70)

        @pytest.mark.parametrize("bench_config", [lambda: {"rrc": Rrc(), "limit": "10s"}])
        def test_of_a_configuration(bench):
            my_host.poll(bench.serial(timeout=1), 40)

        @pytest.mark.parametrize(
            "bench_config", [lambda: {"drive": make_epos(1), "sdo_timeout": "1s"}]
        )
        def test_another_option(bench):
            assert bench.devices == ("drive",)
        """
    )
    run().assert_outcomes(passed=2, failed=1)
    run("--bench-limit", "60s").assert_outcomes(passed=3)
    run("--bench-limit", "none").assert_outcomes(passed=3)
    run("-o", "bench_limit=").assert_outcomes(passed=2, failed=1)


@pytest.mark.parametrize("text", ["60", "soon", "-1s"])
def test_a_limit_that_is_not_a_time_is_refused(
    pytester: pytest.Pytester, run: Run, text: str
) -> None:
    pytester.makepyfile("def test_nothing(): pass")
    result = run(f"--bench-limit={text}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: --bench-limit {text}: '{text}' *write *, or none"])

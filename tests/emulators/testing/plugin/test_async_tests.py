from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)


def test_an_async_test_runs_in_the_time_of_its_bench(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.parametrize("ms", [10, 20])
        async def test_sleep(bench, ms):
            await bench.sleep(f"{ms}ms")
            assert bench.now_us == ms * 1_000

        async def test_edge(bench):
            await bench.sleep("1s")
            bench.press("power_button")
            assert await bench.edge("state") == "Standby"

        class TestInAClass:
            async def test_it(self, bench):
                await bench.sleep("1s")
                assert bench.now_us == 0
        """
    )
    result = run()
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines([">*assert bench.now_us == 0", "*assert 1000000 == 0"])


def test_async_tests_of_others_are_theirs(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(
        f"""{RRC}
import asyncio

def pytest_configure(config):
    config.addinivalue_line("markers", "asyncio: of a loop")

@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    if pyfuncitem.get_closest_marker("asyncio"):
        asyncio.run(pyfuncitem.obj(pyfuncitem.funcargs["bench"]))
        return True
"""
    )
    pytester.makepyfile(
        """
        import asyncio
        import pytest

        @pytest.mark.asyncio
        async def test_of_asyncio(bench):
            assert asyncio.get_running_loop()

        async def test_of_the_bench(bench):
            with pytest.raises(RuntimeError):
                asyncio.get_running_loop()
        """
    )
    run().assert_outcomes(passed=2)


def test_what_a_bench_cannot_await_is_told(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import asyncio

        async def test_one(bench):
            await asyncio.sleep(0)
        """
    )
    run().stdout.fnmatch_lines(
        ["*a bench waits for bench.sleep, bench.until, bench.edge, and for tasks*"]
    )


def test_a_task_that_failed_fails_the_test(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        async def watch(bench):
            await bench.sleep("100ms")
            assert bench.get("state") == "Lost"

        def test_nobody_asks(bench):
            bench.start(watch(bench))
            bench.run_for("1s")

        async def test_it_is_awaited(bench):
            with pytest.raises(AssertionError):
                await bench.start(watch(bench))

        def test_it_is_not_over(bench):
            bench.start(watch(bench))
        """
    )
    result = run()
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines([">*assert bench.get('state') == 'Lost'".replace("'", '"')])

from __future__ import annotations

import pytest

from tests.emulators.testing.conformance.stacks import R1_EDS
from tests.emulators.testing.plugin.conftest import Run, run

__all__ = ["run"]  # a fixture

pytest_plugins = ("pytester",)

SUITE = """
from tickrig.device import make_epos
from tickrig.testing import conformance_tests

test_drive = conformance_tests(lambda: make_epos(5), only="NMT-0[345]")
"""


def test_one_line_gives_a_test_a_check(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(SUITE)
    result = run()
    result.assert_outcomes(passed=3)
    result.stdout.fnmatch_lines(["PASSED *::test_drive[[]NMT-03]"])


def test_only_what_is_selected_is_judged(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(SUITE)
    run("-k", "NMT-04").assert_outcomes(passed=1, deselected=2)


def test_a_failure_tells_clause_and_frames_and_no_traceback(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        from tickrig.device import make_epos
        from tickrig.testing import conformance_tests

        class Deaf:
            def __init__(self):
                self.slave, self.node_id = make_epos(5), 5
            def __getattr__(self, name):
                return getattr(self.slave, name)
            def tick(self, now_us, rx):
                return self.slave.tick(now_us, tuple(f for f in rx if f.can_id))

        test_deaf = conformance_tests(Deaf, only="NMT-03")
        """
    )
    result = run()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["NMT-03: Start remote node*", "CiA 301 *", "* > *000   [[]2]  01 05 *start, node 5"]
    )
    result.stdout.fnmatch_lines(["FAILED *test_deaf[[]NMT-03] - Failed: step *: *want *"])
    result.stdout.no_fnmatch_line("*--full-trace*")
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*pytest_suite.py*")


def test_a_device_of_the_bench_is_judged_check_by_check(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        f"""
        import pytest
        from tickrig.testing import conformance_tests

        @pytest.fixture
        def bench_config():
            return {{"board": "5={R1_EDS}"}}

        test_board = conformance_tests("board", eds={str(R1_EDS)!r}, only=["NMT-03", "OD-1000*"])
        """
    )
    outcomes = run().parseoutcomes()
    assert outcomes.get("failed", 0) == outcomes.get("errors", 0) == 0
    assert outcomes["passed"] > 2


def test_a_run_that_cannot_be_is_not_repeated_for_each_test(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        from tickrig.testing import conformance_tests

        made = []

        def make():
            made.append(1)
            if len(made) > 1:
                raise RuntimeError(f"made {len(made)} times")

        test_broken = conformance_tests(make, node_id=5, only="NMT-0[345]")
        """
    )
    result = run()
    result.assert_outcomes(failed=3)
    result.stdout.no_fnmatch_line("*made 3 times*")


def test_a_dead_node_is_blocked_not_failed(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        from tickrig.testing import conformance_tests

        def make():
            return lambda now_us, frames: ()

        test_dead = conformance_tests(lambda: make, node_id=5, only="NMT-03")
        """
    )
    result = run()
    result.stdout.fnmatch_lines(["*BenchBlocked: blocked: *"])
    result.stdout.no_fnmatch_line("*--full-trace*")

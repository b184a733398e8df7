from __future__ import annotations

from xml.etree.ElementTree import parse

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


def test_a_known_failure_is_expected(pytester: pytest.Pytester, run: Run) -> None:
    given = "power_on, node_id=5, only='UE-01,UE-02,UE-13', baseline='known.txt'"
    (pytester.path / "known.txt").write_text("UE-01  # has no 1000h\nUE-13\n")
    pytester.makepyfile(f"{MINE}\ntest_mine = conformance_tests({given})")
    result = run()
    result.assert_outcomes(passed=1, failed=1, xfailed=1)
    result.stdout.fnmatch_lines(["XFAIL *test_mine[[]UE-01] - *known: step 1, read 1000:00*"])


def test_a_baseline_with_ids_that_are_none_is_warned_of(
    pytester: pytest.Pytester, run: Run
) -> None:
    (pytester.path / "known.txt").write_text("UE-01\nUE-1O1\n")
    given = "power_on, node_id=5, only='UE-01', baseline='known.txt'"
    pytester.makepyfile(f"{MINE}\ntest_mine = conformance_tests({given})")
    result = run("-W", "default")
    result.assert_outcomes(xfailed=1, warnings=1)
    said = "*.py:*: UserWarning: baseline known.txt: UE-1O1: no such group or check; *"
    result.stdout.fnmatch_lines([said, "*test_mine = conformance_tests(*"])


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


MINE = """
from tickrig import CanFrame
from tickrig.testing import conformance_tests

def power_on():
    waiting = [CanFrame(0x705, b"\\0")]
    def step(now_us, frames):
        asked = [frame for frame in frames if (frame.can_id, frame.extended) == (0x605, False)]
        refused = [b"\\x80" + frame.data[1:4] + b"\\0\\0\\2\\6" for frame in asked]
        waiting.extend(CanFrame(0x585, data) for data in refused)
        sent = waiting[:]
        waiting.clear()
        return sent
    return step
"""


@pytest.mark.parametrize("node", ["power_on", "lambda: power_on"])
def test_a_callable_of_yours_is_given_as_it_is_or_made(
    pytester: pytest.Pytester, run: Run, node: str
) -> None:
    pytester.makepyfile(f"{MINE}\ntest_mine = conformance_tests({node}, node_id=5, only='UE-13')")
    run().assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ("power_on, node_id=5, level='read_only'", "level 'read_only' is not one of read-only, *"),
        ("power_on", "node_id is 1..127, not None; this slave does not tell it itself"),
        ("lambda: power_on, eds='r1.eds'", "node_id is 1..127, not None; *"),
    ],
)
def test_what_cannot_be_is_told_once_before_all_tests(
    pytester: pytest.Pytester, run: Run, given: str, why: str
) -> None:
    (pytester.path / "r1.eds").write_bytes(R1_EDS.read_bytes())
    pytester.makepyfile(f"{MINE}\ntest_mine = conformance_tests({given})")
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([f"E   ValueError: {why}"])


def test_a_run_that_cannot_be_is_told_once(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        from tickrig.device import make_epos
        from tickrig.testing import conformance_tests

        made = []

        def make():
            made.append(1)
            if len(made) > 1:
                raise RuntimeError(f"made {len(made)} times")
            return make_epos(5)

        test_broken = conformance_tests(make, only="NMT-0[3456]")
        """
    )
    result = run()
    result.assert_outcomes(failed=4)
    said = result.stdout.str()
    assert said.count("raise RuntimeError(") == 1, "one traceback, however many tests"
    assert said.count("as before: RuntimeError: made 2 times") == 6
    result.stdout.no_fnmatch_line("*made 3 times*")


@pytest.mark.parametrize(
    ("sent", "reason"),
    [("()", "node 5 does not answer; other nodes: none"), ("[CanFrame(0x706)]", "*other nodes: 6")],
)
def test_a_dead_node_is_an_error_in_a_line(
    pytester: pytest.Pytester, run: Run, sent: str, reason: str
) -> None:
    pytester.makepyfile(
        f"""
        from tickrig import CanFrame
        from tickrig.testing import conformance_tests

        def make():
            return lambda now_us, frames: {sent}

        test_dead = conformance_tests(make, node_id=5, only="NMT-0[34]")
        """
    )
    result = run("--junitxml=x.xml")
    result.assert_outcomes(errors=2)
    result.stdout.fnmatch_lines([f"ERROR *test_dead[[]NMT-04] - blocked: {reason}"])
    for line in ("*--full-trace*", "*Report(*", "*pytest_suite.py*"):
        result.stdout.no_fnmatch_line(line)
    suite = parse("x.xml").getroot()[0]
    assert (suite.get("errors"), suite.get("failures")) == ("2", "0")

from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run

pytest_plugins = ("pytester",)

RIG = """
[device.chair]
type = "rrc"

[safe.chair]
state = "WaitPowerOn"
out_v_pct = 0
"""

TESTS = """
import pytest

def test_safe(bench):
    bench.run_for("1s")

def test_unsafe(bench):
    bench.run_for("1s")
    bench.press("power_button")
    bench.run_for("2s")
"""

FIXTURE = """
import pytest

@pytest.fixture
def bench_safe():
    return {safe}
"""

REFUSAL = """
from tickrig import NotOnThisBench

def refuse(bench):
    raise NotOnThisBench("nobody sees the lamp")
"""

UNSAFE = "state is Standby, and safe is WaitPowerOn"


@pytest.mark.parametrize("other", ["", '[device.other]\ntype = "urg"\n'])
def test_a_rig_file_says_which_outputs_are_safe(
    pytester: pytest.Pytester, run: Run, other: str
) -> None:
    pytester.makefile(".toml", rig=RIG + other)
    prefix = "chair/" if other else ""
    pytester.makepyfile(TESTS.replace('press("', f'press("{prefix}'))
    result = run("--bench", "rig.toml")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines([f"{prefix}{UNSAFE}"])


@pytest.mark.parametrize(
    ("safe", "told"),
    [
        ("{'state': 'Standby'}", "state is WaitPowerOn, and safe is Standby"),
        ("{'chair/state': 'Standby'}", "state is WaitPowerOn, and safe is Standby"),
        ("{'out_w_pct': 0}", UNSAFE),
        ("lambda bench: True", UNSAFE),
    ],
)
def test_a_fixture_says_it_otherwise(
    pytester: pytest.Pytester, run: Run, safe: str, told: str
) -> None:
    pytester.makefile(".toml", rig=RIG)
    pytester.makepyfile(TESTS)
    pytester.makeconftest(FIXTURE.format(safe=safe))
    result = run("--bench", "rig.toml")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines([told])


def test_a_check_of_a_fixture_is_asked_too(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makefile(".toml", rig=RIG)
    pytester.makepyfile(TESTS)
    pytester.makeconftest(FIXTURE.format(safe="lambda bench: 'the lamp is on'"))
    result = run("--bench", "rig.toml", "-k", "test_safe")
    result.assert_outcomes(failed=1, deselected=1)
    result.stdout.fnmatch_lines(["the lamp is on"])


def test_a_check_that_this_bench_cannot_do_skips_no_test_that_has_passed(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makefile(".toml", rig=RIG)
    pytester.makepyfile(
        TESTS
        + """
def test_failed(bench):
    assert 0

def test_skipped(bench):
    refuse(bench)
"""
        + REFUSAL
    )
    pytester.makeconftest(REFUSAL + FIXTURE.format(safe="refuse"))
    result = run("--bench", "rig.toml", "-k", "not unsafe")
    result.assert_outcomes(errors=1, failed=1, skipped=1)
    told = "the test has passed, but bench_safe cannot be checked: nobody sees the lamp"
    result.stdout.fnmatch_lines(
        [f"ERROR *::test_safe - blocked: {told}", "FAILED *::test_failed - *assert 0"]
    )


def test_a_check_that_this_bench_cannot_do_hides_nothing_else(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makefile(".toml", rig='[device.urg]\ntype = "urg"\n')
    pytester.makepyfile(
        """
        def test_lost(bench):
            bench.run_for("3s")
            bench.link.send(b"SCIP2.0\\nBM\\nMD0044072501000\\n")
            bench.run_for("5s")  # nobody reads
        """
    )
    pytester.makeconftest(REFUSAL + FIXTURE.format(safe="refuse"))
    result = run("--bench", "rig.toml")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["urg: * bytes found a buffer full", "bench_safe cannot be checked: nobody sees the lamp"]
    )

from __future__ import annotations

import re

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)


def test_runs_that_are_the_same_pass(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        runs = []

        @pytest.fixture(scope="module")
        def shared():
            yield runs.append("shared")
            assert runs == ["shared", "one", "one", "two", "none"]

        @pytest.mark.req("SAF-1")
        def test_one(bench, shared):
            runs.append("one")
            bench.fault("flip=0.01")
            bench.press("power_button")
            bench.run_for("1s")

        def test_two(bench, shared):
            runs.append("two")
            assert not bench.devices

        def test_without_a_bench(shared):
            runs.append("none")

        @pytest.mark.skip
        def test_last(bench, shared):
            pass
        """
    )
    result = run("--bench-compare", "--junitxml=out.xml")
    result.assert_outcomes(passed=2, failed=1, skipped=1)
    result.stdout.fnmatch_lines(["bench: 1 test was the same in both runs; hash of all *"])
    properties = re.findall('<property name="(\\w+)"', (pytester.path / "out.xml").read_text())
    assert properties == ["req", "bench_hash"]


@pytest.mark.parametrize(
    ("act", "line"),
    [
        ("bench.link.send(b'hello\\n' if runs else b'bye\\n')", "rrc > bye*"),
        ("bench.set('stick', len(runs), 0)", "power_button=0"),
        ("bench.run_for(f'{len(runs) + 1}s')", "(the end)"),
    ],
)
def test_the_first_difference_fails_the_test(
    pytester: pytest.Pytester, run: Run, act: str, line: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        f"""
        runs = []

        def test_one(bench):
            bench.run_for("1s")
            bench.press("power_button")
            {act}
            runs.append("once")
            bench.run_for("1s")
        """
    )
    result = run("--bench-compare")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["the second run differs from the first at line *", f"*  first run:  *{line}"]
    )


def test_what_tests_share_is_given_back_after_the_last(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture(scope="module")
        def shared():
            yield
            raise RuntimeError("not well")

        def test_one(bench, shared):
            assert 0
        """
    )
    result = run("--bench-compare")
    result.assert_outcomes(failed=1, errors=1)
    result.stdout.fnmatch_lines(["*RuntimeError: not well"])


def test_hashes_do_not_depend_on_workers_or_on_the_seed_of_hashes(
    pytester: pytest.Pytester, run_apart: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.parametrize("ms", [10, 20])
        def test_one(bench, ms):
            bench.fault("flip=0.01")
            bench.press("power_button")
            bench.run_for(f"{ms}ms")
        """
    )
    hashes = set()
    for hash_seed, options in (("1", ("-n1",)), ("2", ())):
        monkeypatch.setenv("PYTHONHASHSEED", hash_seed)
        lines = run_apart(*options, "--bench-compare").outlines
        (line,) = [line for line in lines if line.startswith("bench: 2 tests were the same")]
        hashes.add(line)
    assert len(hashes) == 1

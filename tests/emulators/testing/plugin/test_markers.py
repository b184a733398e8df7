from __future__ import annotations

from xml.etree import ElementTree as Xml

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)


@pytest.mark.parametrize(
    ("needs", "skipped"),
    [
        ("'virtual'", ""),
        ("'hand', 'fault:cut', 'fault:vr2_fault', 'input:stick', 'output:state'", ""),
        ("'device:rrc'", ""),
        ("'real or virtual'", ""),
        ("'device:urg or fault:cut'", ""),
        ("'real'", "needs real, and this bench is virtual"),
        ("'real or hardware'", "needs real or hardware, and this bench is virtual"),
        ("'virtual', 'fault:smoke'", "needs fault:smoke: no fault 'smoke'; known: *cut*"),
        ("'device:urg'", "needs device:urg: no device 'urg'; known: rrc"),
        ("'real or input:lamp'", "needs *: this bench is virtual and no input 'lamp'; known: *"),
    ],
)
def test_a_test_runs_where_all_is_that_it_needs(
    pytester: pytest.Pytester, run: Run, needs: str, skipped: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        f"""
        import pytest

        @pytest.mark.needs({needs})
        def test_one(bench):
            pass
        """
    )
    result = run()
    result.assert_outcomes(passed=not skipped, skipped=bool(skipped))
    if skipped:
        result.stdout.fnmatch_lines([f"SKIPPED [[]1[]] test_*.py:3: {skipped}"])


def test_what_nobody_can_have_is_an_error(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.needs("fault:cut", "vitual")
        def test_one(bench):
            pass
        """
    )
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["no bench: needs('vitual'): unknown; did you mean 'virtual'[?]"])


def test_markers_of_a_module_count_too(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        pytestmark = pytest.mark.needs("hardware")

        def test_one(bench):
            pass

        def test_without_a_bench():
            pass
        """
    )
    run().assert_outcomes(passed=1, skipped=1)


def test_what_a_bench_cannot_do_skips_the_test(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest
        from tickrig.emulators.testing.bench.errors import NotOnThisBench

        @pytest.fixture
        def plug(bench):
            raise NotOnThisBench("no plug here")

        @pytest.mark.xfail(strict=True)
        def test_one(bench):
            raise NotOnThisBench("no hand here")

        def test_two(plug):
            pass
        """
    )
    result = run()
    result.assert_outcomes(skipped=2)
    result.stdout.fnmatch_lines(["SKIPPED*.py:8: no hand here", "SKIPPED*.py:12: no plug here"])


def test_requirements_stand_in_junit_files(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.req("SAF-12", "SAF-13")
        def test_one():
            pass

        @pytest.mark.req("SAF-14")
        @pytest.mark.skip
        def test_two():
            pass
        """
    )
    run("--junitxml=out.xml")
    found = Xml.parse(pytester.path / "out.xml").iter("property")
    assert [(item.get("name"), item.get("value")) for item in found] == [
        ("req", "SAF-12"),
        ("req", "SAF-13"),
        ("req", "SAF-14"),
    ]


def test_requirements_of_a_test_that_runs_again_stand_in_junit_files_once(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        import pytest

        runs = []

        @pytest.mark.req("SAF-12")
        def test_one():
            runs.append(1)
            assert len(runs) == 3
        """
    )
    run("-p", "pytest_rerunfailures", "--reruns=2", "--junitxml=out.xml").assert_outcomes(passed=1)
    cases = Xml.parse(pytester.path / "out.xml").iter("testcase")
    assert [len(list(case.iter("property"))) for case in cases] == [1, 1, 1]


def test_markers_are_told(run: Run) -> None:
    run("--markers").stdout.fnmatch_lines(
        ["@pytest.mark.needs([*]what): *(tickrig)", "@pytest.mark.req([*]names): *(tickrig)"]
    )


def write_test_that_needs(need: str, pytester: pytest.Pytester) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        f"""
        import pytest

        @pytest.mark.needs({need!r})
        def test_one(bench):
            pass
        """
    )


@pytest.mark.parametrize(
    ("need", "told"),
    [
        ("fault:cutt", "needs('fault:cutt'): no fault 'cutt'; did you mean 'cut'?"),
        ("fault:no_answer", "needs('fault:no_answer'): no fault 'no_answer'; did you mean 'cut'?"),
        ("input:Stick", "needs('input:Stick'): no input 'Stick'; did you mean 'stick'?"),
        ("output:stete", "needs('output:stete'): no output 'stete'; did you mean 'state'?"),
        ("device:rcr", "needs('device:rcr'): no device 'rcr'; did you mean 'rrc'?"),
        ("real or fault:cutt", "needs('fault:cutt'): no fault 'cutt'; did you mean 'cut'?"),
        ("vitual", "needs('vitual'): unknown; did you mean 'virtual'?"),
        ("fault", "needs('fault'): unknown; did you mean 'fault:NAME'?"),
        ("falt:cut", "needs('falt:cut'): unknown; did you mean 'fault:cut'?"),
    ],
)
def test_what_is_misspelt_is_an_error_and_no_skip(
    pytester: pytest.Pytester, run: Run, need: str, told: str
) -> None:
    write_test_that_needs(need, pytester)
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([f"no bench: {told}"])


@pytest.mark.parametrize("need", ["fault:power_cut", "input:stick2", "device:rrc2"])
def test_what_other_devices_could_have_is_no_misspelling(
    pytester: pytest.Pytester, run: Run, need: str
) -> None:
    write_test_that_needs(need, pytester)
    run().assert_outcomes(skipped=1)


@pytest.mark.parametrize(
    ("marker", "told"),
    [
        ("needs()", "test_one: @needs names nothing: write @pytest.mark.needs('fault:cut')"),
        ("needs", "test_one: @needs names nothing: write @pytest.mark.needs('fault:cut')"),
        ("req()", "test_one: @req names nothing: write @pytest.mark.req('SAF-12')"),
        ("req('')", "test_one: @req takes names as texts, not ''"),
        ("req(12)", "test_one: @req takes names as texts, not 12"),
        ("req(id='SAF-12')", "test_one: @req takes names alone, as 'SAF-12', not id='SAF-12'"),
        ("allows()", "test_one: @allows names nothing: write @pytest.mark.allows('lost')"),
    ],
)
def test_a_marker_without_names_is_an_error_at_collection(
    pytester: pytest.Pytester, run: Run, marker: str, told: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        f"""
        import pytest

        class TestIt:
            @pytest.mark.{marker}
            def test_one(self, bench):
                pass
        """
    )
    result = run()
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*ERROR collecting*", f"*{told}"])


def test_markers_of_other_packages_may_have_our_names(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.needs(database=True)
        @pytest.mark.needs
        @pytest.mark.allows
        @pytest.mark.req(12, why="so")
        def test_one():
            pass

        @pytest.mark.req
        class TestIt:
            def test_two(self):
                pass
        """
    )
    result = run("--continue-on-collection-errors")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*test_two: @req names nothing: write @pytest.mark.req('SAF-12')"])

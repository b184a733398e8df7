from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)

MISSPELT = """
def helper(bench):
    bench.fault("ctu")

def test_one(bench):
    helper(bench)
"""


@pytest.mark.parametrize("mode", ["virtual", pytest.param("real", marks=pytest.mark.realtime)])
def test_a_refusal_is_shown_in_the_line_of_the_caller(
    pytester: pytest.Pytester, run: Run, mode: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(MISSPELT)
    result = run("--bench-mode", mode)
    skip_if_too_slow(result)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ['>*bench.fault("ctu")', "E *ValueError: no fault 'ctu'; did you mean 'cut'?"]
    )
    result.stdout.no_fnmatch_line("*bench.py*")
    result.stdout.no_fnmatch_line("*rig_thread.py*")


UNENDED = """
def test_one(bench):
    async def watch():
        await bench.until(lambda: False)

    task = bench.start(watch())
    bench.run_for("1s")
    task.result()
"""


def test_a_task_that_has_not_ended_is_shown_in_the_line_that_reads_it(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    name = pytester.makepyfile(UNENDED).name
    result = run()
    result.assert_outcomes(failed=1)
    message = f"E *RuntimeError: the task has not ended yet: it waits at {name}:3"
    result.stdout.fnmatch_lines([">*task.result()", message, f"{name}:7: RuntimeError"])
    result.stdout.no_fnmatch_line("*tasks.py*")


@pytest.mark.parametrize(
    "call",
    [
        'bench.fault("cut", when=lambda: wrong(bench))',
        'bench.wait_until(lambda: wrong(bench), "1s")',
        "bench.start(watch(bench))",
        "bench.run(watch(bench))",
    ],
)
def test_an_error_in_a_condition_is_shown_in_lines_of_the_user(
    pytester: pytest.Pytester, run: Run, call: str
) -> None:
    pytester.makeconftest(RRC)
    text = f"""
        def wrong(bench):
            return bench.now_us > 1000 and None + 1

        async def watch(bench):
            await bench.until(lambda: wrong(bench))

        def test_one(bench):
            {call}
            bench.run_for("1s")
        """
    name = pytester.makepyfile(text).name
    result = run()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([">*bench.now_us > 1000 and None + 1", f"{name}:2: TypeError"])
    result.stdout.no_fnmatch_line("*tasks.py*")
    result.stdout.no_fnmatch_line("*bench.py*")
    result.stdout.no_fnmatch_line("*rig.py*")
    run("--full-trace").stdout.fnmatch_lines(["*bench.py:*"])


def test_all_of_it_is_shown_to_who_asks(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(MISSPELT)
    run("--full-trace").stdout.fnmatch_lines(["*bench.py:*"])


def test_what_is_no_refusal_is_shown_whole(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        from tickrig.emulators.testing.bench.bench import BenchDevice

        def test_one(bench):
            BenchDevice(None).press("power_button")
        """
    )
    run().stdout.fnmatch_lines(["E *AttributeError: *", "*bench.py:*: AttributeError"])


def test_a_bench_that_is_not_there_needs_no_traceback(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makefile(
        ".toml",
        rig="""
        [device.rrc]
        type = "rrc"
        [hardware]
        control = "none.ctl"
        [hardware.rrc]
        port = "/dev/none"
        """,
    )
    pytester.makepyfile("def test_one(bench): pass")
    result = run("--bench", "rig.toml", "--bench-mode", "hardware")
    result.stdout.fnmatch_lines(
        [
            "_* ERROR at setup of test_one _*",
            "-* bench: blocked -*",
            "rrc: no emulator at *none.ctl*",
        ],
        consecutive=True,
    )
    result.stdout.fnmatch_lines(["ERROR *::test_one - *blocked: rrc: no emulator at *"])

from __future__ import annotations

import os

import pytest

from tests.emulators.canopen.bus_file.system import write_system
from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tests.emulators.testing.plugin.test_bench_fixture import RRC

pytest_plugins = ("pytester",)

RIG = """
seed = 4

[device.stick]
type = "rrc"

[device.scanner]
type = "urg"
"""


@pytest.fixture
def rig_file(pytester: pytest.Pytester) -> None:
    pytester.makefile(".toml", rig=RIG)


DEVICES = """
def test_devices(bench):
    assert bench.devices == ("stick", "scanner")
"""


@pytest.mark.usefixtures("rig_file")
def test_a_rig_file_of_the_command_line_comes_first(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(DEVICES)
    run().assert_outcomes(failed=1)
    result = run("--bench", "rig.toml")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["bench: */rig.toml, virtual"])


@pytest.mark.usefixtures("rig_file")
def test_a_rig_file_of_the_configuration_comes_last(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeini("[pytest]\nbench = rig.toml\nbench_seed = 9\n")
    folder = pytester.mkpydir("inside")
    (folder / "test_devices.py").write_text(DEVICES)
    (folder / "test_own.py").write_text(
        RRC + '\ndef test_own(bench):\n    assert bench.devices == ("rrc",)\n    assert 0\n'
    )
    os.chdir(folder)
    result = run()
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["rrc; virtual, seed 9, *", "pytest test_own.py::test_own *"])


@pytest.mark.usefixtures("rig_file")
def test_a_rig_file_of_a_test_stands_beside_it(pytester: pytest.Pytester, run: Run) -> None:
    folder = pytester.mkpydir("inside")
    (folder / "own.toml").write_text(RIG)
    (folder / "test_devices.py").write_text(
        "import pytest\n\n@pytest.mark.parametrize('bench_config', ['own.toml'])" + DEVICES
    )
    run().assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--bench nowhere.toml", "ERROR: */nowhere.toml: No such file or directory"),
        ("--bench bad.toml", "ERROR: */bad.toml:2: *teapot*"),
        (
            "--bench-mode vitual",
            "ERROR: --bench-mode vitual: 'vitual' is not one of virtual, real, *",
        ),
        ("--bench-seed dice", "ERROR: --bench-seed dice: it is a number from 0 on, or random"),
        ("--bench-artifacts-of none", "ERROR: --bench-artifacts-of none: it is failed or every"),
        ("--bench-report no/out.html", "ERROR: report */no/out.html: no directory */no"),
        (
            "--bench-compare --bench-mode real",
            "ERROR: --bench-compare compares runs in virtual time only",
        ),
    ],
)
def test_a_mistake_in_an_option_is_a_line(
    pytester: pytest.Pytester, run: Run, options: str, said: str
) -> None:
    pytester.makefile(".toml", bad='[device.x]\ntype = "teapot"\n')
    result = run(*options.split())
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([said])
    result.stderr.no_fnmatch_line("*Traceback*")


def test_a_random_seed_is_printed_and_repeated(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile("def test_one(bench):\n    assert 0\n")
    result = run("--bench-seed", "random")
    (head,) = [line for line in result.outlines if line.startswith("bench: of each test")]
    seed = head.rpartition(" ")[2]
    result.stdout.fnmatch_lines([f"rrc; virtual, seed {seed}, *", f"pytest * --bench-seed {seed}"])


@pytest.mark.realtime
def test_each_test_runs_in_each_mode(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest
        from tickrig.host import RrcClient

        def test_state(bench):
            with RrcClient(bench.link) as client:
                client.start()
                assert bench.get("state") != "Output"

        @pytest.mark.needs("virtual")
        def test_time(bench):
            bench.run_for("100s")

        @pytest.mark.parametrize("bench_mode", ["virtual"])
        def test_own_mode(bench):
            assert bench.mode == "virtual"
        """
    )
    result = run("--bench-mode", "virtual,real")
    skip_if_too_slow(result)
    result.assert_outcomes(passed=4, skipped=1)
    result.stdout.fnmatch_lines_random(
        ["PASSED *::test_state[[]virtual]", "PASSED *::test_state[[]real]"]
    )


def test_hardware_stands_in_a_rig_file(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile("def test_one(bench):\n    pass\n")
    result = run("--bench-mode", "hardware")
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines(["SKIPPED * where the hardware is stands in a rig file: --bench*"])


def test_who_asks_for_nothing_sees_nothing(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile("def test_one():\n    pass\n")
    assert not [line for line in run().outlines if "bench" in line or "tickrig" in line]


def test_a_bus_yml_is_a_bench_too(pytester: pytest.Pytester, run: Run) -> None:
    write_system(pytester.path)
    pytester.makepyfile("""
        def test_a_joint(bench):
            bench.run_for("10ms")
            assert bench.devices == ("joint_1",)
            assert bench.get("drive_state") == "Switch on disabled"
    """)
    result = run("--bench", "bus.yml")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["bench: */bus.yml, virtual"])
    (pytester.path / "joint.eds").unlink()
    missing = run("--bench", "bus.yml")
    missing.stdout.fnmatch_lines(["*bus.yml:*joint_1: dcf: no file 'joint.eds'*"])


@pytest.mark.parametrize("source", ["'bus.yml'", "Path('bus.yml')", "'bus.yml:joint_1'"])
def test_a_bus_yml_is_a_bench_by_its_name(pytester: pytest.Pytester, run: Run, source: str) -> None:
    write_system(pytester.path)
    pytester.makepyfile(f"""
        from pathlib import Path
        import pytest

        @pytest.fixture
        def bench_config():
            return {source}

        def test_a_joint(bench):
            assert bench.devices == ("joint_1",)
    """)
    run().assert_outcomes(passed=1)

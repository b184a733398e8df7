from __future__ import annotations

from pathlib import Path

import pytest

from tests.emulators.testing.plugin.conftest import Run

pytest_plugins = ("pytester",)

RRC = """
import pytest
from tickrig.device import Rrc

@pytest.fixture
def bench_config():
    return Rrc()
"""


def test_each_test_has_a_fresh_bench(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        def test_it_runs(bench):
            assert (bench.now_us, bench.mode) == (0, "virtual")
            bench.run_for("1s")

        def test_it_is_new(bench):
            assert bench.now_us == 0
        """
    )
    run().assert_outcomes(passed=2)


@pytest.mark.parametrize(
    ("source", "devices"),
    [
        ("Rrc()", "rrc"),
        ("Rrc", "rrc"),
        ("lambda: make_epos(1)", "node1"),
        ("'rtc-lite'", "rtc_lite"),
        ("dict(left=make_epos(1), right=make_epos(2))", "left right"),
        ("dict(stick=Rrc(), seed=3)", "stick"),
    ],
)
def test_what_can_be_on_a_bench(
    pytester: pytest.Pytester, run: Run, source: str, devices: str
) -> None:
    pytester.makepyfile(
        f"""
        import pytest
        from tickrig.device import Rrc, make_epos

        @pytest.fixture
        def bench_config():
            return {source}

        def test_devices(bench):
            assert bench.devices == {tuple(devices.split())}
        """
    )
    run().assert_outcomes(passed=1)


def test_sources_may_be_parameters(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.device import Rrc, make_epos

        @pytest.mark.parametrize("times", [1, 2])
        @pytest.mark.parametrize("bench_config", [Rrc(), make_epos(1)], ids=["rrc", "epos"])
        def test_direct(bench, times):
            assert bench.now_us == 0
            assert bench.wait_until(lambda: bench.get("state") != "Off", within="1s")
            bench.run_for("2s")

        @pytest.mark.parametrize("bench", ["rrc", Rrc], indirect=True)
        def test_indirect(bench):
            assert bench.devices == ("rrc",)

        @pytest.mark.parametrize("bench_config", ["rrc"], indirect=True)
        def test_indirect_too(bench):
            assert bench.devices == ("rrc",)
        """
    )
    run().assert_outcomes(passed=7)


def test_a_project_may_build_on_the_fixture(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import unittest
        import pytest

        @pytest.fixture
        def bench(bench):
            bench.run_for("1s")
            return bench

        @pytest.mark.parametrize("ms", [1, 20])
        def test_it_runs(bench, ms):
            assert bench.now_us == 1_000_000

        class TestOfUnittest(unittest.TestCase):
            @pytest.fixture(autouse=True)
            def _bench(self, bench):
                self.bench = bench

            def test_it_runs_too(self):
                self.assertEqual(self.bench.now_us, 1_000_000)
        """
    )
    run().assert_outcomes(passed=3)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("None", "the bench has no configuration: write a fixture bench_config"),
        ("{}", "a bench has at least one device"),
        ("'teapot'", "teapot"),
        ("ONE", "a device that a test has used"),
        ("5", "int is 5, and that is no device"),
        ("dict(left=Rrc)", "left is <class *Rrc'>, and that is no device"),
        ("dict(left=Rrc(), sed=1)", "sed is 1, and that is no device"),
        ("dict(left=Rrc(), seed='x')", "seed is a number, not 'x'"),
    ],
)
def test_what_cannot_be_on_a_bench_is_told_in_a_line(
    pytester: pytest.Pytester, run: Run, source: str, said: str
) -> None:
    pytester.makepyfile(
        f"""
        import pytest
        from tickrig.device import Rrc

        ONE = Rrc()

        @pytest.fixture
        def bench_config():
            return {source}

        def test_before(bench):
            pass

        def test_one(bench):
            pass
        """
    )
    result = run()
    assert result.parseoutcomes()["errors"] >= 1
    result.stdout.fnmatch_lines([f"no bench: *{said}*"])
    result.stdout.no_fnmatch_line("*Traceback*")


def test_a_host_opens_the_line_by_its_name(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest
        import serial
        from tickrig.device import Rrc

        @pytest.fixture
        def bench_config():
            return {"chair": Rrc()}

        def test_it(bench):
            with serial.serial_for_url("tickrig://chair", 115_200, timeout=1) as port:
                port.write(b"device\\n")
                assert port.read_until(b"RRC\\n").endswith(b"RRC\\n")
        """
    )
    run().assert_outcomes(passed=1)


def test_a_safe_output_that_is_not_there_is_told_before_the_test(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.device import Rrc

        @pytest.fixture
        def bench_config():
            return Rrc()

        @pytest.fixture
        def bench_safe():
            return {"sate": "Off"}

        def test_it(bench):
            pass
        """
    )
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(['*no bench: no input or output "sate"; did you mean *'])


@pytest.mark.parametrize("device", ["'epos'", "'2=drive.eds'", "dict(epos='epos')", "'lamp.py:L'"])
def test_a_device_by_what_a_rig_file_calls_it(
    pytester: pytest.Pytester, run: Run, device: str
) -> None:
    examples = Path(__file__).parents[4] / "examples"
    folder = pytester.mkdir("sub")  # where the test is, and not where pytest runs
    (folder / "drive.eds").write_bytes((examples / "eds" / "epos.eds").read_bytes())
    (folder / "lamp.py").write_bytes((examples / "device_rtc_gripper.py").read_bytes())
    (folder / "test_it.py").write_text(
        "import pytest\n@pytest.fixture\n"
        f"def bench_config(): return {device.replace('lamp.py:L', '7=lamp.py:Gripper')}\n"
        "def test_one(bench):\n    bench.run_for('1s')\n    assert bench.get('state')\n"
    )
    run().assert_outcomes(passed=1)


def test_a_misspelt_device_is_told_in_a_line(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture
        def bench_config():
            return "EPOS"

        def test_one(bench):
            pass
        """
    )
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["no bench: no device 'EPOS'; did you mean 'epos'? *"])

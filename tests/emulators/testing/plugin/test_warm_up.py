from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC
from tickrig.emulators.can.faults import CanFaults
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine

pytest_plugins = ("pytester",)

WARM = """
from pathlib import Path

import pytest

@pytest.fixture
def bench_warm_up():
    def switch_on(bench):
        bench.run_for("1s")
        bench.press("power_button")
        assert bench.wait_until(lambda: bench.get("state") == "Standby", within="2s")
    return switch_on
"""


def test_a_test_begins_with_a_bench_that_is_warm(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        WARM
        + """
def test_it(bench):
    assert bench.get("state") == "Standby"
    assert bench.now_us > 1_000_000
    assert bench.transcript() == ""
    bench.link.send(b"device\\n")
    bench.run_for("20ms")
    assert "OK" in bench.transcript() or "< " in bench.transcript()
    bench.save_trace("run.trace")
    assert "power_button=1" in Path("run.trace").read_text()
"""
    )
    run("--bench-seed", "7").assert_outcomes(passed=1)
    text = (pytester.path / "run.trace").read_text("utf-8")
    assert '"seed":7' in text.partition("\n")[0].replace(" ", "")


def test_a_warm_up_may_be_async_and_be_in_real_time(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture
        def bench_warm_up():
            async def wait(bench):
                await bench.sleep("20ms")
            return wait

        def test_it(bench):
            assert bench.now_us >= 20_000
        """
    )
    run("--bench-mode", "virtual").assert_outcomes(passed=1)


@pytest.mark.realtime
def test_in_real_time_the_bench_itself_is_warmed_up(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(f"{WARM}\ndef test_it(bench): assert bench.get('state') == 'Standby'\n")
    run("--bench-mode", "real").assert_outcomes(passed=1)


@pytest.mark.parametrize("wrong", ["bench.fault('nothing')", "bench.press('nothing')"])
def test_a_warm_up_that_is_wrong_is_told(pytester: pytest.Pytester, run: Run, wrong: str) -> None:
    pytester.makeconftest(RRC)
    fixture = f"@pytest.fixture\ndef bench_warm_up(): return lambda bench: {wrong}\n"
    pytester.makepyfile(f"import pytest\n{fixture}\ndef test_it(bench): pass\n")
    result = run()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["no bench: *nothing*"])


@pytest.mark.parametrize(("keeps", "copied"), [("1", True), ("lambda: None", False)])
def test_a_device_that_cannot_be_copied_is_warmed_up_itself(
    pytester: pytest.Pytester, run: Run, keeps: str, copied: bool
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        WARM
        + """
from tickrig.device import Rrc

@pytest.fixture
def bench_config():
    class Mine(Rrc):
        pass
    mine = Mine()
    mine.own = KEEPS
    return mine

def test_it(bench):
    assert bench.get("state") == "Standby"
    assert ("power_button" not in bench.transcript()) is COPIED
""".replace("KEEPS", keeps).replace("COPIED", str(copied))
    )
    run().assert_outcomes(passed=1)


def test_a_line_knows_whether_anything_was_left_to_chance() -> None:
    port = FaultyPort(SerialLine(115_200).a, BYTE_FAULTS, 1)
    port.arm("cut")
    assert not port.drawn
    port.arm("flip", "0.5")
    port.clear("flip")
    assert port.drawn


def test_a_bus_knows_whether_anything_was_left_to_chance() -> None:
    faults = CanFaults(1, lambda name, begins: None)
    assert not faults.drawn
    faults.arm("corrupt", "0.5")
    faults.judge(())
    assert faults.drawn

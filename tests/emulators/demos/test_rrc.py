from __future__ import annotations

import pytest
from click.testing import CliRunner

from tests.host.spy_link import LateLink
from tests.wire.rrc.samples import SAMPLES
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.bench.child import running
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.commands.cli import main
from tickrig.emulators.demos.rrc import play
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.requests import VERSION, Object


@pytest.mark.parametrize("stopped", [False, True])
@pytest.mark.parametrize("late_us", [250_000, 1_200_000, 2_500_000])
def test_the_demo_of_the_rrc_goes_on_after_a_lag(late_us: int, stopped: bool) -> None:
    for from_us in range(0, 7_000_000, 310_000):
        emulator = Emulator("rrc", Rrc())
        control = EmulatorControl(emulator)

        def request(do: str, **fields: object) -> Object:
            return control.answer({"v": VERSION, "do": do, **fields})  # noqa: B023 - called at once

        lines = list[str]()
        link = SimLink(emulator.rig, emulator.host_end)
        play(LateLink(link, from_us, from_us + late_us, stopped=stopped), request, lines.append)
        assert lines[-1].startswith("\nDone."), from_us


@pytest.mark.realtime
def test_the_demo_shows_all_samples_and_the_watchdog() -> None:
    result = CliRunner().invoke(main, ["demo", "rrc"])
    assert result.exit_code == 0, result.output
    sent = [line.split(">", 1)[1].strip() for line in result.output.splitlines() if " > " in line]
    names = [line.decode()[:-1] for line in SAMPLES]
    assert [line for line in names if any(text.startswith(line) for text in sent)] == names
    assert "EV:PowerOnSuccess" in result.output
    assert "EV:PowerOffWaitByWatchdog" in result.output
    assert "lost bytes: 0" in result.output


def test_an_emulator_that_does_not_start_is_told() -> None:
    with (
        pytest.raises(RuntimeError, match=r"did not start: .*no_such_module"),
        running("tickrig.no_such_module"),
    ):
        pass

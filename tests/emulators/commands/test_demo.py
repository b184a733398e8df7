from __future__ import annotations

import time

import pytest
from click.testing import CliRunner

from tests.wire.rrc.samples import SAMPLES
from tickrig.emulators.bench.child import running
from tickrig.emulators.commands.cli import main


@pytest.mark.realtime
def test_the_demo_shows_all_samples_and_the_watchdog_and_ends_in_under_20_s() -> None:
    start = time.monotonic()
    result = CliRunner().invoke(main, ["demo", "rrc"])
    assert result.exit_code == 0, result.output
    assert time.monotonic() - start < 20
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

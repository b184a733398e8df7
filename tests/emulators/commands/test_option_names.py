"""What is said of a bad option begins with its name."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from tickrig.host.cli.start import load

MAINS = {
    "rrc-emu": "tickrig.emulators.rrc.cli:main",
    "rh3": "tickrig.emulators.rh3.commands.motion_cli:main",
    "rh3-emu": "tickrig.emulators.rh3.cli:main",
    "urg-emu": "tickrig.emulators.urg.cli:main",
    "rtc-lite-emu": "tickrig.emulators.rtc_lite.cli:main",
    "tickrig": "tickrig.emulators.commands.cli:main",
}


def stderr(line: str) -> str:
    command, *words = line.split()
    result = CliRunner().invoke(load(MAINS[command]), words)
    assert result.exit_code == 2
    return result.stderr


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("rh3-emu --tread-m 0", "--tread-m 0.0 is not above 0 and below 1000"),
        ("rh3-emu --address 300", "--address 300 is not in 1..247"),
        ("rh3-emu --delay-ms -1", "--delay-ms -1 is not in 0..60000"),
        ("rh3 goto 1 0 0 --radius-left-m nan", "--radius-left-m nan is not above 0"),
        ("rh3 square --friction -2", "--friction -2.0 is not in 0..10"),
        ("rrc-emu --battery-wh 500", "--battery-wh does nothing without --vehicle"),
        ("tickrig emu rrc --battery-wh 500", "--battery-wh does nothing without --vehicle"),
        ("urg-emu --noise 1", "--noise does nothing without --room, --wall or --post"),
        ("urg-emu --serial é", "--serial: serial 'é' is not letters and digits"),
        ("urg-emu --room 4", "--room: a room is WIDTH,DEPTH in m, got '4'"),
        ("urg-emu --wall 1", "--wall: a wall is X1,Y1,X2,Y2 in m, got '1'"),
        ("urg-emu --post 1,2,-1", "--post: a post has a place and a radius of 0 or more"),
        ("rtc-lite-emu --node nope", "--node: no node 'nope'; known: echo"),
        ("rrc-emu --fault flip=2", "--fault: flip takes a rate above 0"),
        ("rrc-emu --fault nope", "--fault: no fault 'nope'; known: flip"),
        ("rrc-emu --fault cut@soon", "--fault: 'soon' is not a time"),
        ("tickrig ctl /nowhere press key --for soon", "--for: 'soon' is not a time"),
        ("tickrig rtc run --lite-boot soon", "--lite-boot: 'soon' is not a time"),
        ("tickrig rtc act A0 --wait soon", "--wait: 'soon' is not a time"),
        ("tickrig rtc print A0.out --for soon", "--for: 'soon' is not a time"),
    ],
)
def test_a_bad_value_is_told_by_the_option(line: str, error: str) -> None:
    told = stderr(line)
    assert told.startswith(f"Error: {error}")
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "option"),
    [
        ("rh3 square --side nan", "--side"),
        ("rh3 goto 1 0 0 --pace nan", "--pace"),
        ("urg-emu --noise nan", "--noise"),
        ("tickrig rtc run --rate nan", "--rate"),
        ("tickrig rtc run --rate 0", "--rate"),
        ("tickrig rtc create ConsoleIn --rate 1e7", "--rate"),
    ],
)
def test_no_number_is_refused_as_one_out_of_range_is(line: str, option: str) -> None:
    assert f"Error: Invalid value for '{option}'" in stderr(line)

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.urg.cli import main as urg_emu
from tickrig.emulators.urg.device_type import build_urg

SCENARIO = """
0 send SCIP2.0
0 send VV
1ms expect SERI:H0000001;6 within 10ms
10ms set pose 0.5 0 0.25
20ms send MD0384038401002;a
21ms expect 99b within 210ms
260ms set post 1.5 0.25 0.25
400ms send QT
401ms expect QT within 10ms
410ms raw ff 0d
500ms end
"""
WORLD = ("--room", "4,3", "--post", "1,1,0.2", "--wall", "-1,-1,-1,1")


def emu(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(urg_emu, [str(word) for word in words], input=text)


def test_a_scenario_is_played_in_virtual_time() -> None:
    words = ("--serial", "H0000001", *WORLD, "--scenario", "-")
    result = emu(*words, text=SCENARIO)
    assert (result.exit_code, result.stderr) == (
        0,
        "ran 0.500 s; bytes lost: 0\nexpectations met: 3; missed: 0\n",
    )
    assert "< 0E" in result.stdout
    assert emu(*words, text=SCENARIO).stdout == result.stdout


def test_whole_scans_at_once_find_room_on_the_line() -> None:
    text = "0 send SCIP2.0\n0 send BM\n1ms send GD0000076800\n2ms send MD0000076800001\n300ms end"
    assert emu("--scenario", "-", text=text).stderr == "ran 0.300 s; bytes lost: 0\n"


def test_a_recorded_scenario_replays_identically(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    words = (*WORLD, "--noise", "1", "--seed", "7", "--fault", "flip=0.001")
    emu("--scenario", "-", "--trace", trace, *words, text=SCENARIO)
    assert "! heading_rad=0.25" in trace.read_text()
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(r"identical: \d+ ticks\n", result.stdout)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--room", "4"), "--room: a room is WIDTH,DEPTH in m, got '4'"),
        (("--room", "0,1"), "--room: a room has a width and a depth above 0, got 0.0, 1.0"),
        (("--wall", "1,2,3,x"), "--wall: a wall is X1,Y1,X2,Y2 in m, got '1,2,3,x'"),
        (("--post", "1,2,-3"), "--post: a post has a place and a radius of 0 or more, got"),
        (("--serial", "a b"), "--serial: serial 'a b' is not letters and digits"),
    ],
)
def test_an_impossible_world_is_one_line(words: tuple[str, ...], told: str) -> None:
    result = emu(*words)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {told}")
    assert result.stderr.count("\n") == 1


def test_it_starts_in_the_protocol_that_is_asked_for() -> None:
    text = "0 send VV\n10ms end"
    assert " < E\n" in emu("--scenario", "-", text=text).stdout
    assert " < 00P\n" in emu("--scip", "2.0", "--scenario", "-", text=text).stdout


def test_a_trace_of_before_starts_in_scip_2() -> None:
    assert build_urg({"serial": "H1"}).parameters.scip == "2.0"
    assert build_urg({"scip": "1.1"}).parameters.scip == "1.1"


@pytest.mark.parametrize(
    ("config", "told"),
    [
        ('{"colour": 1}', "a sensor has no setting 'colour'; known: serial, "),
        ('{"noise": "loud"}', "noise 'loud' and noise_seed 0 are not two numbers"),
        ('{"walls": "1,2"}', "a wall is X1,Y1,X2,Y2 in m, got '1,2'"),
    ],
)
def test_a_trace_of_another_sensor_is_refused(config: str, told: str, tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    trace.write_text(f"# tickrig-trace v1 urg {config}\n0.000000 . end\n")
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert result.exit_code == 2
    assert told in result.stderr

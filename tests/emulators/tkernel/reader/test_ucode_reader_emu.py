"""The command `ucode-reader-emu`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.tkernel.reader.cli import main as reader_emu
from tickrig.emulators.tkernel.reader.device_type import build_reader

DOOR = "00001C00000000000001000000000001"
SCENARIO = f"""
199ms send ID
200ms expect $UI,1,3000,90,1*EB02 within 30ms
290ms expect $UC,0,{DOOR},67*D522 within 60ms
350ms set pose 0 0 3.1416
380ms expect $UR,1,0*9D15 within 60ms
450ms set sunlight 1
480ms expect $UL,2*F428 within 60ms
600ms send off
601ms expect $UE*E92B within 20ms
700ms end
"""
MARKERS = ("--marker", f"{DOOR},1,0")
GOLDEN = Path(__file__).parents[3] / "golden" / "ucode_reader.trace"


def emu(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(reader_emu, [str(word) for word in words], input=text)


def test_a_scenario_is_played_in_virtual_time() -> None:
    result = emu(*MARKERS, "--scenario", "-", text=SCENARIO)
    assert (result.exit_code, result.stderr) == (
        0,
        "ran 0.700 s; bytes lost: 0\nexpectations met: 5; missed: 0\n",
    )
    assert emu(*MARKERS, "--scenario", "-", text=SCENARIO).stdout == result.stdout


def test_its_lines_have_room_on_the_line() -> None:
    words = [word for n in range(20) for word in ("--marker", f"{n:032X},1,{n / 100}")]
    result = emu(*words, "--scenario", "-", text="2s end")
    assert result.stderr == "ran 2.000 s; bytes lost: 0\n"
    assert len(re.findall(r"\$UR,\d+,6\*", result.stdout)) >= 17


def test_a_recorded_scenario_replays_identically(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    words = ("--seed", "7", "--fault", "flip=0.001", "--trace", trace)
    emu(*MARKERS, *words, "--scenario", "-", text=SCENARIO)
    assert "! heading_rad=3.1416" in trace.read_text()
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(r"identical: \d+ ticks\n", result.stdout)


def test_the_golden_trace_is_made_again_to_the_byte(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    emu(*MARKERS, "--trace", trace, "--scenario", "-", text=SCENARIO)
    assert trace.read_bytes() == GOLDEN.read_bytes()
    assert CliRunner().invoke(tickrig, ["replay", str(GOLDEN)]).exit_code == 0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--marker", "1,2,3"), "--marker: ucode '1' is not 32 hex digits"),
        (("--marker", DOOR), f"--marker: a marker is UCODE,X,Y in m, got '{DOOR}'"),
        (("--marker", f"{DOOR},1,nan"), "--marker: a marker has a place, got 1.0, nan"),
    ],
)
def test_an_impossible_marker_is_one_line(words: tuple[str, ...], told: str) -> None:
    result = emu(*words)
    assert (result.exit_code, result.stderr) == (2, f"Error: {told}\n")


@pytest.mark.parametrize(
    ("config", "told"),
    [
        ({"range": 1}, "a reader has no setting 'range'; known: range_m, cone_deg, markers"),
        ({"range_m": "far"}, "range_m 'far' and cone_deg 90 are not two numbers"),
        ({"cone_deg": 400}, "cone_deg 400 is not in 1..360"),
    ],
)
def test_a_trace_of_no_reader_is_refused(config: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        build_reader(config)  # type: ignore[arg-type]

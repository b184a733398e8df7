from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rh3.cli import main as rh3_emu

SCENARIO = """
0 read device_id
10ms write mode 1
20ms write command 1
30ms write 0x100 0 0x7000 0 0x7000
31ms expect 01 10 01 00 00 04 within 20ms
400ms read 0x204 2
401ms expect 01 03 04 00 00* within 20ms
450ms fault emergency_stop
500ms read fault_left
501ms expect 01 03 02 00 10 within 20ms
510ms raw 01 03 00
600ms end
"""


def emu(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(rh3_emu, [str(word) for word in words], input=text)


def test_a_scenario_is_played_in_virtual_time() -> None:
    result = emu("--scenario", "-", text=SCENARIO)
    assert (result.exit_code, result.stderr) == (
        0,
        "ran 0.600 s; bytes lost: 0\nexpectations met: 3; missed: 0\n",
    )
    assert "0.003608 < 01 03 02 52 48\n" in result.stdout
    assert emu("--scenario", "-", text=SCENARIO).stdout == result.stdout


def test_a_recorded_scenario_replays_identically(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    words = ("--noise", "0.02", "--friction", "0.5", "--seed", "7", "--fault", "flip=0.001")
    emu("--scenario", "-", "--trace", trace, *words, text=SCENARIO)
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(r"identical: \d+ ticks\n", result.stdout)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("0 read", "read takes a register's name, or an address and a number, got ''"),
        ("0 read nothing 2", "no register 'nothing'; known: "),
        ("0 read 0x10000 2", "register 0x10000 is not in 0..0xFFFF"),
        ("0 read 0x200 x", "'x' is not a whole number"),
        ("0 write", "write takes a register and its value, got ''"),
        ("0 raw xyz", "raw takes bytes in hex"),
    ],
)
def test_a_mistake_in_a_scenario_is_one_line(line: str, told: str) -> None:
    result = emu("--scenario", "-", text=f"{line}\n1 end")
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_an_impossible_parameter_is_one_line() -> None:
    result = emu("--address", "300")
    assert (result.exit_code, result.stderr) == (2, "Error: --address 300 is not in 1..247\n")


@pytest.mark.parametrize(
    ("config", "told"),
    [
        ('{"colour": 1}', "a base has no parameter 'colour'; known: address, "),
        ('{"tread_m": "wide"}', "tread_m is 'wide', expected is a number"),
        ('{"address": 1.5}', "address is 1.5, expected is a whole number"),
    ],
)
def test_a_trace_of_another_base_is_refused(config: str, told: str, tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    trace.write_text(f"# tickrig-trace v1 rh3-base {config}\n0.000000 . end\n")
    result = CliRunner().invoke(tickrig, ["replay", str(trace)])
    assert result.exit_code == 2
    assert told in result.stderr

"""A URG-04LX as it starts: what real ones answered is in tests/golden/scip_urg_04lx.json."""

from __future__ import annotations

import json
from itertools import chain
from pathlib import Path
from typing import Any, Final

import pytest

from tests.device.urg.measured import Measured
from tickrig.device.urg.world import UrgParameters, World, room
from tickrig.wire.scip import encode_lines, parse_lines, parse_number, parse_numbers, without_sum

GOLDEN: Final[dict[str, Any]] = json.loads(
    (Path(__file__).parents[2] / "golden" / "scip_urg_04lx.json").read_text()
)
FIRST, SECOND = GOLDEN["scip_1_1"], GOLDEN["scip_2_0"]
CAPTURE: Final = "G00076801"


def started(world: World | None = None) -> Measured:
    return Measured(world or room(4, 3), scip="1.1")


def answer(measured: Measured, line: str, within_ms: int = 1) -> list[str]:
    """Return the lines behind the echo."""
    sent = measured.run(within_ms, line.encode() + b"\n").decode()
    assert sent.startswith(f"{line}\n")
    assert sent.endswith("\n\n")
    return sent[len(line) + 1 : -2].split("\n")


def switched() -> Measured:
    measured = started()
    assert answer(measured, "SCIP2.0") == ["0"]
    return measured


def test_sums_and_numbers_of_real_sensors_are_ours() -> None:
    for command in ("VV", "PP", "II"):
        values = [line.encode() for line in SECOND[command][1:]]
        assert encode_lines(parse_lines(values)) == tuple(values)
    scan = SECOND["GD0044072501"]
    assert parse_number(without_sum(scan["stamp"].encode())) == scan["time_ms"]
    block = without_sum(scan["block"].encode())
    assert list(parse_numbers(block[:63], 3)) == scan["distances"]
    block = FIRST[CAPTURE]["block"].encode()
    assert list(parse_numbers(block, 2)) == FIRST[CAPTURE]["distances"]


def test_it_says_in_scip_1_1_what_it_is() -> None:
    lines = answer(started(), "V")
    ours, theirs = (dict(line.split(":", 1) for line in text[1:]) for text in (lines, FIRST["V"]))
    assert lines[0] == FIRST["V"][0]
    for key in ("VEND", "PROD", "PROT"):
        assert ours[key] == theirs[key]
    assert ours["FIRM"].partition("(")[2] == theirs["FIRM"].partition("(")[2]
    assert ours["SERI"] == UrgParameters().serial


def test_its_laser_is_on_and_it_measures() -> None:
    measured = started()
    assert measured.urg.read("laser") == 1
    measured.run(1_000)
    golden = FIRST[CAPTURE]
    sent = measured.run(1, CAPTURE.encode() + b"\n")
    status, *blocks = answer(measured, CAPTURE)
    assert status == golden["status"]
    assert len(sent) == len(CAPTURE) + 1 + golden["bytes_behind_the_echo"]
    assert (len(blocks), len(blocks[-1])) == (golden["blocks"], golden["last_block"])
    numbers = parse_numbers("".join(blocks).encode(), 2)
    unmeasured = chain(*(range(a, b + 1) for a, b in golden["not_measured_steps"]))
    assert {numbers[step] for step in unmeasured} == {golden["not_measurable"]}
    assert numbers[384] == 2_000


def test_the_first_scan_is_waited_for() -> None:
    measured = started()
    assert measured.run(98, CAPTURE.encode() + b"\n") == b""
    assert measured.run(1, b"G38438401\n") == b"G38438401\nE\n\n"  # one waits already
    sent = measured.run(1)
    assert (measured.now_us, sent[:12]) == (100_000, b"G00076801\n0\n")


def test_two_characters_carry_4095_at_most() -> None:
    measured = started(room(9, 9))
    measured.run(100)
    assert answer(measured, "G38438401") == ["0", "oo"]


def test_only_whole_clusters_are_sent() -> None:
    measured = started()
    measured.run(100)
    assert [len(answer(measured, f"G38238{last}03")[1]) for last in (4, 6, 7)] == [2, 2, 4]


@pytest.mark.parametrize(
    "line", ["QT", "VV", "TM2", "GD0044072501", "V1", "L2", "G00076901", "G38538401", "S000", ""]
)
def test_what_is_not_scip_1_1_is_answered_with_e(line: str) -> None:
    measured = started()
    if line:
        assert answer(measured, line) == ["E"]
    else:
        assert measured.run(1, b"\n") == b""


def test_the_laser_is_switched() -> None:
    measured = started()
    assert (answer(measured, "L0"), measured.urg.read("laser")) == (["0"], 0)
    assert answer(measured, CAPTURE) == ["E"]
    assert (answer(measured, "L1"), measured.urg.read("laser")) == (["0"], 1)
    assert answer(measured, "L1") == ["0"]


def test_the_bit_rate_is_taken() -> None:
    measured = started()
    rates = ("S0192000000000", "S1152000000000", "S1234560000000")
    assert [answer(measured, line) for line in rates] == [["0"], ["0"], ["E"]]


def test_trouble_ends_a_capture_and_keeps_the_laser_off() -> None:
    measured = started()
    measured.run(10, CAPTURE.encode() + b"\n")
    measured.urg.inputs.set("motor_jammed", 1)
    assert measured.run(1) == b"G00076801\nE\n\n"
    assert answer(measured, "L1") == ["E"]
    measured.urg.reset()
    measured.run(1)
    assert measured.urg.read("laser") == 0


@pytest.mark.parametrize("command", ["PP", "BM", "CR00"])
def test_switched_it_answers_as_a_real_one(command: str) -> None:
    assert answer(switched(), command) == SECOND[command]


def test_switched_its_laser_is_on_and_its_mode_classic_until_it_is_told_to_measure() -> None:
    measured = switched()
    ours, theirs = answer(measured, "II"), SECOND["II"]
    assert [line for line in ours if "TIME" not in line] == [
        line for line in theirs if "TIME" not in line
    ]
    measured.run(100)
    assert answer(measured, "GD0384038401")[0] == "00P"
    assert measured.ask("MD0384038401000") == "00"
    assert any(line.startswith("MESM:Measuring by Normal Mode;") for line in answer(measured, "II"))


def test_only_a_loss_of_power_leads_back() -> None:
    measured = switched()
    assert (measured.ask("SCIP2.0"), measured.ask("RS"), measured.ask("VV")) == ("0E", "00", "00")
    assert measured.urg.read("laser") == 0
    measured.urg.inputs.set("power_cut", 1)
    measured.run(10)
    measured.urg.inputs.set("power_cut", 0)
    measured.run(10)
    assert answer(measured, "VV") == ["E"]
    assert measured.urg.read("laser") == 1

"""--strict: a log of which something could not be taken is status 4, with every verb."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.sources import source as block_log

WELL = "(0000000001.000000) can0 705#7F\n"
NOISE = "what?\n"
CAN_XL = "(0000000001.000000) can0 45123#81:00:12345678#1122\n"
VERBS = [
    ["dump", "--raw"],
    ["dump", "--jsonl"],
    ["top"],
    ["stats"],
    ["nodes"],
    ["check", "--no-emcy"],
    ["graph", "705[0]"],
]


def canmon(verb: list[str], path: Path) -> Result:
    name, *options = verb
    return CliRunner().invoke(main, [name, str(path), *options, "--strict"])


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "run.log"


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("damage", [NOISE, CAN_XL])
def test_noise_and_can_xl_end_a_strict_run_with_4(verb: list[str], damage: str, log: Path) -> None:
    log.write_text(WELL + damage, "ascii")
    result = canmon(verb, log)
    assert result.exit_code == 4, result.output
    assert result.stderr.splitlines()[-1] == "Error: 1 lines or frames passed over"


@pytest.mark.parametrize("verb", VERBS)
def test_a_whole_log_ends_a_strict_run_with_0(verb: list[str], log: Path) -> None:
    log.write_text(WELL, "ascii")
    assert canmon(verb, log).exit_code == 0


@pytest.mark.parametrize("verb", [["stats"], ["top"], ["check", "--no-emcy"]])
def test_a_large_log_is_no_exception(
    verb: list[str], log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log.write_text(WELL + NOISE + CAN_XL, "ascii")
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    result = canmon(verb, log)
    assert result.exit_code == 4
    assert result.stderr.splitlines()[-1] == "Error: 2 lines or frames passed over"


def test_conv_too_and_what_was_lost_stands_beside(log: Path) -> None:
    log.write_text(WELL + NOISE + '{"v":1,"ev":"drop","n":12}\n', "ascii")
    words = ["conv", str(log), str(log.with_suffix(".jsonl")), "--strict"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 4
    assert result.stderr.splitlines()[-1] == (
        "Error: 12 frames were lost, 1 lines or frames passed over"
    )


def test_what_is_no_frame_by_its_nature_is_no_loss(log: Path) -> None:
    text = WELL + '{"v":1,"ev":"line","t":1.0,"ch":"port","data":""}\n# a comment\n'
    log.write_text(text, "ascii")
    result = canmon(["dump"], log)
    assert (result.exit_code, "lines of a serial port passed over" in result.stderr) == (0, True)


@pytest.mark.parametrize("small_bytes", [0, 1 << 20])
def test_what_is_no_frame_by_its_nature_breaks_no_loss_neither(
    small_bytes: int, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", small_bytes)
    log.write_text("  can0  705   [1]  7F\n  ttyS0  <  SA:64\n", "ascii")
    result = canmon(["check", "--no-loss"], log)
    assert (result.exit_code, result.stdout) == (0, "")
    log.write_text("  can0  705   [1]  7F\nnoise\n", "ascii")
    result = canmon(["check", "--no-loss"], log)
    assert "no-loss" in result.stdout

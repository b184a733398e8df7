"""`tickrig demo rtc-lite`: what it shows, in virtual and in real time."""

from __future__ import annotations

import re
import time

import pytest
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main

LINE = re.compile(r" +(\d+\.\d{3}) (.*)")


def played(*options: str) -> list[tuple[float, str]]:
    """Return the lines with a time."""
    result = CliRunner().invoke(main, ["demo", "rtc-lite", *options])
    assert result.exit_code == 0, result.output
    matches = map(LINE.fullmatch, result.output.splitlines())
    return [(float(match[1]), match[2]) for match in matches if match]


def at_s(lines: list[tuple[float, str]], text: str) -> float:
    """Return the time of the one line that begins so."""
    (found,) = [time_s for time_s, line in lines if line.startswith(text)]
    return found


def received(lines: list[tuple[float, str]]) -> list[int]:
    return [int(line.split()[-1]) for _, line in lines if line.startswith("ConsoleOut0 received")]


def test_in_virtual_time_it_is_the_same_each_time() -> None:
    assert played("--virtual") == played("--virtual")


def test_numbers_pass_the_power_cut_shows_and_the_device_comes_back() -> None:
    lines = played("--virtual")
    texts = [line for _, line in lines]
    assert received(lines) == [1, -5, 2_147_483_647, 42]
    assert [text for text in texts if text.startswith("> CY")] == [
        f"> CY\\x0{number}       PING" for number in (1, 2, 3, 4)
    ]
    assert "= ConsoleIn0 Active, LiteA0 Error, LiteB0 Active, ConsoleOut0 Active" in texts
    removed = texts.index("* Removed of LiteA0")
    assert texts[removed + 1 : removed + 3] == [
        "= ConsoleIn0 Active, LiteB0 Active, ConsoleOut0 Active",
        "=   LiteB0.out -> ConsoleOut0.in",
    ]
    assert at_s(lines, "* FatalError") == pytest.approx(at_s(lines, "> AE") + 0.5, abs=0.001)
    assert at_s(lines, "* Removed") == pytest.approx(at_s(lines, "* FatalError") + 1, abs=0.01)
    rediscovered = texts.index("* Rediscovered of LiteA0")
    assert texts[rediscovered + 1].endswith("LiteA0 Inactive")


@pytest.mark.realtime
def test_in_real_time_it_shows_the_same_and_ends_in_under_20_s() -> None:
    start_s = time.monotonic()
    lines = played()
    assert time.monotonic() - start_s < 20
    assert received(lines) == [1, -5, 2_147_483_647, 42]
    assert at_s(lines, "* FatalError") == pytest.approx(at_s(lines, "> AE") + 0.5, abs=0.1)
    assert at_s(lines, "* Removed") == pytest.approx(at_s(lines, "* FatalError") + 1, abs=0.1)
    assert at_s(lines, "* Rediscovered") < 2

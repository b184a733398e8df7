"""`tickrig demo rtc-lite`: what it shows, in virtual and in real time."""

from __future__ import annotations

import re

import pytest
from click.testing import CliRunner

from tests.host.spy_link import LateLink
from tickrig.emulators.commands.cli import main
from tickrig.emulators.demos.rtc_lite import NODES, VirtualSetup, run_demo

LINE = re.compile(r" +(\d+\.\d{3}) (.*)")
LOSS = [f"* {event} of LiteA0" for event in ("FatalError", "Removed", "Rediscovered")]


def played(*options: str) -> list[tuple[float, str]]:
    result = CliRunner().invoke(main, ["demo", "rtc-lite", *options])
    assert result.exit_code == 0, result.output
    return timed(result.output.splitlines())


def timed(lines: list[str]) -> list[tuple[float, str]]:
    """Return the lines with a time."""
    matches = map(LINE.fullmatch, lines)
    return [(float(match[1]), match[2]) for match in matches if match]


def at_s(lines: list[tuple[float, str]], text: str) -> float:
    """Return the time of the one line that begins so."""
    (found,) = [time_s for time_s, line in lines if line.startswith(text)]
    return found


def received(lines: list[tuple[float, str]]) -> list[int]:
    return [int(line.split()[-1]) for _, line in lines if line.startswith("ConsoleOut0 received")]


def late_demo(name: str, from_us: int, late_us: int, *, stopped: bool) -> list[tuple[float, str]]:
    """Return the lines of a run in which a device, or the host, is late once."""
    setup, lines = VirtualSetup(), list[str]()
    late = LateLink(setup.links[name], from_us, from_us + late_us, stopped=stopped)
    setup.links = {**setup.links, name: late}
    run_demo(setup, lines.append)
    return timed(lines)


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


@pytest.mark.parametrize("late_us", [120_000, 350_000, 1_000_000])
@pytest.mark.parametrize("name", NODES)
@pytest.mark.parametrize("stopped", [False, True])
def test_the_demo_goes_on_after_a_lag(name: str, late_us: int, stopped: bool) -> None:
    """120 ms: one reply is missing; 350 ms: some PINGs too; 1 s: the device counts as lost."""
    for from_us in range(0, 9_000_000, 700_000):
        lines = late_demo(name, from_us, late_us, stopped=stopped)
        assert [*dict.fromkeys(received(lines))] == [1, -5, 2_147_483_647, 42], from_us
        assert [line for _, line in lines if line in LOSS][-3:] == LOSS, from_us


@pytest.mark.realtime
def test_in_real_time_it_shows_the_same() -> None:
    lines = played()
    assert [*dict.fromkeys(received(lines))] == [1, -5, 2_147_483_647, 42]
    assert [line for _, line in lines if line in LOSS][-3:] == LOSS

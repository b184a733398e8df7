"""The terminal of a system: typed numbers in, received numbers out."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.host.rtc.chain import PERIOD_US, Chain
from tickrig.host.rtc import Manager
from tickrig.host.rtc.commands.console import Console
from tickrig.host.rtc.motion.components.position_input import USAGE, PositionInput


class Bench(Chain):
    """A chain with a console, whose keyboard is a pipe."""

    def __init__(self) -> None:
        super().__init__()
        self.shown: list[str] = []
        self.told: list[str] = []
        self.console = Console(self.manager, self.shown.append, self.told.append)
        self._keyboard, self.keys = os.pipe()

    def type(self, text: bytes) -> None:
        os.write(self.keys, text)
        self.run()

    def run(self) -> None:
        for _ in range(5):
            self.console.read(self._keyboard)
            self.manager.run_for(PERIOD_US)

    def close(self) -> None:
        os.close(self._keyboard)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_typed_numbers_pass_the_chain_and_are_shown(bench: Bench) -> None:
    bench.type(b"1\n-5\r\n 2147483647 \n")
    assert bench.shown == [f"ConsoleOut0 {number}" for number in (1, -5, 2_147_483_647)]


def test_a_line_counts_when_it_is_whole(bench: Bench) -> None:
    bench.type(b"1")
    assert bench.shown == []
    bench.type(b"2\n")
    assert bench.shown == ["ConsoleOut0 12"]


@pytest.mark.parametrize("line", ["x", "2147483648", "-2147483649", "1.5", "", "9" * 800])
def test_what_is_no_number_is_told_and_passes_nothing(bench: Bench, line: str) -> None:
    bench.type(f"{line}\n7\n".encode())
    assert bench.told == [f"{line!r} is not a number in -2147483648..2147483647"]
    assert bench.shown == ["ConsoleOut0 7"]


def test_after_the_end_of_the_input_nothing_is_read(bench: Bench) -> None:
    bench.type(b"3\n")
    os.close(bench.keys)
    bench.run()
    assert bench.shown == ["ConsoleOut0 3"]


def test_the_last_line_counts_when_the_input_ends(bench: Bench) -> None:
    bench.type(b"1\n2")
    os.close(bench.keys)
    bench.run()
    bench.keys = os.dup(0)
    assert bench.shown == ["ConsoleOut0 1", "ConsoleOut0 2"]
    assert not bench.console.is_open


def test_a_line_goes_to_each_component_that_takes_it() -> None:
    chain = Chain()
    entered = chain.manager.add(PositionInput("PositionInput0"), rate_hz=1_000)
    chain.manager.activate("PositionInput0")
    keyboard, keys = os.pipe()
    shown: list[str] = []
    told: list[str] = []
    console = Console(chain.manager, shown.append, told.append)
    chain.manager.run_for(5 * PERIOD_US)
    os.write(keys, b"7\ngoal 1 0 90\nnothing\n")
    os.close(keys)
    console.read(keyboard)
    os.close(keyboard)
    chain.manager.run_for(5 * PERIOD_US)
    assert sorted(shown) == ["ConsoleOut0 7", "PositionInput0 goal 1.000 0.000 m, 90.0 deg"]
    assert told == [
        f"PositionInput0 {USAGE}",
        "'nothing' is not a number in -2147483648..2147483647; "
        f"'nothing' is not a command: {USAGE}",
    ]
    assert not entered.idle


def test_a_line_that_nobody_takes_is_told() -> None:
    manager = Manager()
    keyboard, keys = os.pipe()
    told: list[str] = []
    console = Console(manager, told.append, told.append)
    os.write(keys, b"5\n")
    console.read(keyboard)
    os.close(keyboard)
    os.close(keys)
    assert told == ["'5': no component takes what is typed"]

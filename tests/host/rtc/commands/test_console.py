"""The terminal of a system: typed numbers in, received numbers out."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.host.rtc.chain import PERIOD_US, Chain
from tickrig.host.rtc.commands.console import Console


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

"""Logs of any length: what is held of them does not grow with them."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
from click.testing import CliRunner

from tickrig.host.canmon.cli import main

RULES = "--no-emcy --max-load 100 -b 1000000 --max-gap 183=1s"
LEAST_BYTES = 50
"""No frame in Python is smaller."""


def write(path: Path, frames: int) -> Path:
    path.write_text(
        "".join(
            f"({n // 1_000:010d}.{n % 1_000:03d}000) can0 {0x181 + n % 20:03X}#{n:016X}\n"
            for n in range(frames)
        ),
        "ascii",
    )
    return path


def peaks(words: list[str], logs: list[Path]) -> list[int]:
    """Return what is held at most of each log; the first is read once before, for imports."""
    found = [peak_bytes([word.format(log=log) for word in words]) for log in (logs[0], *logs)]
    return found[1:]


def peak_bytes(words: list[str]) -> int:
    """Return what Python and numpy held at most."""
    tracemalloc.start()
    try:
        assert CliRunner().invoke(main, words).exit_code in {0, 1}
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return a log of two blocks and a bit, and one three times as long."""
    folder = tmp_path_factory.mktemp("logs")
    return [write(folder / f"{frames}.log", frames) for frames in (60_000, 180_000)]


@pytest.mark.parametrize(
    "verb", ["stats", "stats --by node --jsonl", "top", "nodes", f"check {RULES}"]
)
def test_a_log_of_any_length_takes_the_same_memory(verb: str, logs: list[Path]) -> None:
    short, long = peaks([*verb.split(), "{log}"], logs)
    assert long < 1.1 * short


@pytest.mark.parametrize("sources", [["{log}", "{log}"], ["{log},181:7FF"]])
@pytest.mark.parametrize("verb", ["stats", "nodes", f"check {RULES}"])
def test_and_so_do_logs_that_are_merged_or_filtered(
    verb: str, sources: list[str], tmp_path: Path
) -> None:
    logs = [write(tmp_path / f"{frames}.log", frames) for frames in (2_000, 12_000)]
    short, long = peaks([*verb.split(), *sources], logs)
    assert long < short + 10_000 * LEAST_BYTES

"""Damaged EDS files: a device, or all that is wrong; never anything else."""

from __future__ import annotations

import random
from itertools import groupby
from pathlib import Path
from typing import Final

import pytest

from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.canopen.eds import application_of, describe
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile

ROOT: Final = Path(__file__).parents[4]
FILES: Final = (Path(__file__).parent / "sample.dcf", ROOT / "examples" / "eds" / "epos.eds")
OBJECTS: Final = [
    "\n".join(f"[{section}" for section in sections)
    for path in FILES
    for _, sections in groupby(
        path.read_text("utf-8").split("\n[")[1:], key=lambda section: section[:4]
    )
]
WORDS: Final = (
    *("", "0", "-1", "$NODEID", "0x", "0xFFFFFFFFFFFFFFFFFF", "1e999", "nan", "yes", "€", "\0"),
    *("ro", "8\nObjectType=9", "CompactSubObj=255", "[2000]", "9" * 5_000, "5\nDataType=1"),
)
SAMPLES: Final = 40


def damaged(chance: random.Random) -> str:
    lines = "\n".join(chance.sample(OBJECTS, 4)).split("\n")
    for _ in range(chance.randrange(1, 3)):
        at, word = chance.randrange(len(lines)), chance.choice(WORDS)
        key, equals, _ = lines[at].partition("=")
        lines[at] = chance.choice((f"{key}{equals}{word}", word, f"{lines[at]}{word}", ""))
    return "\n".join(lines)


def run(text: str) -> list[str]:
    """Boot a slave of this text; return what is wrong with the text."""
    try:
        description = describe(EdsFile("a.eds", text))
    except EdsError as error:
        return str(error).split("\n")
    application = application_of(description.template)
    make_slave(description.make_dictionary(), 5, None, application).tick(1_000, ())
    return []


@pytest.mark.parametrize("seed", range(5))
def test_a_damaged_eds_is_a_device_or_says_what_is_wrong(seed: int) -> None:
    chance = random.Random(seed)
    found = [run(damaged(chance)) for _ in range(SAMPLES)]
    assert {bool(lines) for lines in found} == {True, False}
    assert all(line.startswith("a.eds:") for lines in found for line in lines)

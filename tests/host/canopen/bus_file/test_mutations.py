"""Whatever a bus.yml is: findings in lines, never a traceback; tools/fuzz bus does more."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from tests.host.canopen.bus_file.bench import LAMP, MASTER, NODE, ROOT, write_bus
from tests.host.canopen.bus_file.mutations import NAME, judge, mutated
from tests.host.canopen.bus_file.shapes import LAMPS
from tests.host.canopen.data_sheet.mutations import disturbed


@pytest.mark.parametrize("seed", range(6))
def test_a_mutated_bus_file_is_told_well(seed: int) -> None:
    chance = Random(seed)
    for _ in range(12):
        judge(*mutated(chance))


@pytest.mark.parametrize("seed", range(4))
def test_a_mutated_eds_beside_a_bus_file_is_told_well(seed: int, tmp_path: Path) -> None:
    chance = Random(seed)
    path = write_bus(tmp_path, LAMPS.replace("lamp.dcf", "lamp.eds\n  node_id: 7"))
    for _ in range(15):
        eds = disturbed(disturbed(LAMP, chance), chance)
        (tmp_path / "lamp.eds").write_bytes(eds.encode("utf-8", "replace"))
        judge(str(path), path.read_bytes())


def test_the_tool_judges_files_by_several_processes() -> None:
    words = [sys.executable, str(ROOT / "tools" / "fuzz"), "bus", "--files", "10", "-j", "2"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said.startswith("seed 1: 10 files, {")


def test_the_tool_judges_a_kept_file_again(tmp_path: Path) -> None:
    kept = tmp_path / "kept.yml"
    kept.write_bytes(NODE.encode())
    words = [sys.executable, str(ROOT / "tools" / "fuzz"), "bus", str(kept)]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said == f"{kept}: good\n"


def test_noise_is_no_bus() -> None:
    chance = Random(0)
    for size in (0, 1, 2, 10, 1_000, 20_000):
        assert judge(NAME, chance.randbytes(size)) == "wrong"


def test_anchors_that_double_sixty_times_are_read_at_once() -> None:
    lines = ["a0: &a0 [x]", *(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 60))]
    extra = "  tickrig:\n" + "".join(f"    {line}\n" for line in lines)
    assert judge(NAME, (NODE + extra).encode()) == "good"


def test_mappings_that_double_sixty_times_are_sorted_at_once() -> None:
    lines = [
        "a0: &a0 {x: 1}",
        *(f"a{n}: &a{n} {{p: *a{n - 1}, q: *a{n - 1}}}" for n in range(1, 60)),
    ]
    extra = "nodes:\n  a:\n    node_id: 5\n    dcf: epos.eds\n    tickrig:\n"
    text = MASTER + extra + "".join(f"      {line}\n" for line in lines)
    assert judge(NAME, text.encode()) == "good"


@pytest.mark.parametrize(
    "place", ["? {} : 1", "  ? {}\n  : 1", "  tpdo: {{? {} : {{}}}}", "  x: {}"]
)
def test_a_number_of_5000_digits_is_told_in_a_line(place: str) -> None:
    for digits in ("0x" + "F" * 5_000, "9" * 4_000, "0b" + "1" * 20_000):
        judge(NAME, f"{NODE}{place.format(digits)}\n".encode())


def test_a_megabyte_is_no_bus() -> None:
    assert judge(NAME, NODE.encode() + b"#" * (1 << 20)) == "wrong"

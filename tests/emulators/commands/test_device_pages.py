"""The tables of inputs, faults and outputs on the pages of devices are those of the code."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tickrig import Bench, open_bench
from tickrig.device.canopen.models.epos import dictionary
from tickrig.device.physical import InputSignal, SignalType
from tickrig.wire.canopen.drive import DriveState

PAGES = Path(__file__).parents[3] / "docs/reference/devices"
GENERATED = ["epos", "rh3-base"]
NAMED = ["rrc", "urg", "rtc-lite", "motor-core-unit", "f-palette"]
FAR = 1e9
"""An angle that no shaft reaches: the switch at it is never pressed."""


def tables(device: str) -> Iterator[str]:
    """Yield the tables of a page, made from the code."""
    with Bench(device) as bench:
        known = bench.describe()
    inputs = [item for name, item in known.inputs.items() if not name.startswith("0x")]
    levels = [item for item in inputs if item.type is not SignalType.FAULT]
    faults = [item for item in inputs if item.type is SignalType.FAULT]
    yield "| input | range | at the start | meaning |\n|---|---|---|---|\n" + "".join(
        f"| `{item.name}` | {range_of(item)} | {start_of(item)} | {item.text} |\n"
        for item in levels
    )
    yield "| fault | meaning |\n|---|---|\n" + "".join(
        f"| `{item.name}` | {item.text} |\n" for item in faults
    )
    yield "| output | unit | meaning |\n|---|---|---|\n" + "".join(
        f"| `{item.name}` | {item.unit} | {item.text} |\n".replace("|  |", "| |")
        for item in known.outputs.values()
    )


def range_of(item: InputSignal) -> str:
    if item.high == FAR:
        return f"any angle in {item.unit}"
    if (item.low, item.high, item.real) == (0, 1, False):
        return "0, 1"
    return f"{item.low:g}..{item.high:g} {item.unit}".rstrip()


def start_of(item: InputSignal) -> str:
    return "never pressed" if abs(item.initial) == FAR else f"{item.initial:g}"


@pytest.mark.parametrize("device", GENERATED)
def test_a_page_has_the_tables_of_the_code(device: str) -> None:
    page = (PAGES / f"{device}.md").read_text("utf-8")
    for table in tables(device):
        assert f"\n{table}\n" in page


def names(bench: Bench) -> set[str]:
    """Return the names of inputs, faults and outputs; of a row as `di1` to `di8` the first one."""
    known = bench.describe()
    inputs = {name for name in known.inputs if "0x" not in name}
    return {re.sub(r"^([ad][io])\d", r"\g<1>1", name) for name in {*inputs, *known.outputs}}


def named_on(*pages: str) -> set[str]:
    texts = "".join((PAGES / f"{page}.md").read_text("utf-8") for page in pages)
    return set(re.findall(r"`([\w/]+)`", texts))


@pytest.mark.parametrize("device", NAMED)
def test_a_page_names_each_input_fault_and_output(device: str) -> None:
    with Bench(device) as bench:
        found = {name for name in names(bench) if "." not in name}  # the ports of a component
    assert found - named_on(device, "canopen-slave-emu") == set()


def test_the_page_of_bodies_names_each_input_and_output() -> None:
    with open_bench(PAGES.parents[2] / "examples/rigs/beego.toml") as bench:
        found = {name for name in names(bench) if name.startswith("body/")}
    assert found
    assert found - named_on("bodies") == set()


def test_the_page_of_the_drive_has_the_types_and_defaults_of_its_objects() -> None:
    page = (PAGES / "epos.md").read_text("utf-8")
    rows = re.findall(r"^\| (\w{4})h \| ([UI])(\d+) \| ?(\d*) \|", page, re.MULTILINE)
    assert len(rows) >= 20
    objects = dictionary()
    for index, kind, bits, default in rows:
        (entry,) = (each for each in objects.description if each.index == int(index, 16))
        assert entry.data_type.name == f"{'UNSIGNED' if kind == 'U' else 'INTEGER'}{bits}", index
        if default:
            assert int.from_bytes(entry.default, "little", signed=kind == "I") == int(default), (
                index
            )


def test_the_page_of_the_drive_has_the_names_of_its_states() -> None:
    page = " ".join((PAGES / "epos.md").read_text("utf-8").split())
    names = [f"`{state.words}`" for state in DriveState]
    assert f"`drive_state` is {', '.join(names[:-1])} or {names[-1]}" in page

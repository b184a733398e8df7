"""What docs/reference/bench/signals.md shows is read, and its tables name what there is."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.emulators.testing.signals.signal_bench import signals_of
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.eds import read_eds
from tickrig.emulators.canopen.node import Node, NodeSide
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.testing.signals.driver import SignalDriver
from tickrig.emulators.testing.signals.formula import CALLED
from tickrig.emulators.testing.signals.spec_reader import FORMS

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs/reference/bench/signals.md").read_text("utf-8")
BLOCKS = re.findall(r"^```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def devices() -> dict[str, NodeSide]:
    board = read_eds(ROOT / "examples/io_module.eds").make_dictionary()
    slaves = {
        "left": make_epos(2),
        "palette": make_f_palette(1),
        "board": make_slave(board, 5, application=Ds401),
    }
    return {name: NodeSide(Node(name, slave, CanWire())) for name, slave in slaves.items()}


@pytest.mark.parametrize("block", BLOCKS)
def test_an_example_runs(block: str) -> None:
    tables = tomllib.loads(block)
    starts = {
        f"{name}/{key}": value
        for name, device in tables.get("device", {}).items()
        for key, value in device["start"].items()
    }
    driver = SignalDriver(signals_of({**tables.get("signal", {}), **starts}), devices())
    Rig(couplings=[driver]).run_for(100_000)
    assert driver.problems == {}


def test_each_row_shows_a_signal() -> None:
    rows = re.findall(r"^\| `(\{.*?\})` \|", PAGE, re.MULTILINE)
    shown = [tomllib.loads(f"x = {row}")["x"] for row in rows]
    assert {name for table in shown for name in FORMS if name in table} == set(FORMS)
    signals_of({str(number): table for number, table in enumerate(shown) if "column" not in table})


def test_each_function_is_named() -> None:
    (line,) = re.findall(r"^- `abs .*$", PAGE, re.MULTILINE)
    assert [name for name in CALLED if not re.search(rf"\b{name}\b", line)] == []


@pytest.mark.parametrize("name", ["battery", "encoder"])
def test_the_page_shows_the_files(name: str) -> None:
    text = (ROOT / f"examples/rigs/{name}.toml").read_text("utf-8")
    whole = tomllib.loads(text)
    shown = [tomllib.loads(block) for block in BLOCKS]
    starts = {key: {"start": device["start"]} for key, device in whole["device"].items()}
    assert {"signal": whole["signal"], "device": starts} in shown

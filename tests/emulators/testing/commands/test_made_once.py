"""A device is made once, whoever looks at it before it runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from tickrig import compiled
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.canopen.cli import main as canopen_slave_emu
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rrc.cli import main as rrc_emu
from tickrig.emulators.testing.bench.bench import Bench, open_bench
from tickrig.emulators.testing.rig_file.reader import read_rig_file

pytestmark = pytest.mark.skipif(compiled, reason="compiled callers do not see what is replaced")

RIG = """\
[device.chair]
type = "rrc"

[device.left]
type = "epos"
node_id = 1

[device.right]
type = "epos"
node_id = 2
"""


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the classes of which a device is made, as that happens."""
    found: list[str] = []

    def counting(kind: type[Any]) -> Callable[..., None]:
        init = kind.__init__

        def counted(self: Any, *args: Any, **named: Any) -> None:
            found.append(kind.__name__)
            init(self, *args, **named)

        return counted

    for kind in (Rrc, CanopenSlave):
        monkeypatch.setattr(kind, "__init__", counting(kind))
    return found


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    file = tmp_path / "rig.toml"
    file.write_text(RIG)
    return file


def run(command: click.Command, *words: str | Path, typed: str = "") -> None:
    result = CliRunner().invoke(command, list(map(str, words)), input=typed)
    assert result.exit_code == 0, result.output


def test_tickrig_run_makes_each_device_once(made: list[str], rig: Path) -> None:
    run(tickrig, "run", rig, "--virtual", "--for", "10ms", "--fault", "left/power_off@1ms")
    assert sorted(made) == ["CanopenSlave", "CanopenSlave", "Rrc"]


def test_a_bench_takes_what_the_reader_has_made_and_the_next_makes_its_own(
    made: list[str], rig: Path
) -> None:
    with open_bench(rig) as bench:
        assert sorted(made) == ["CanopenSlave", "CanopenSlave", "Rrc"]
        bench["right"].set("power_off", 1)
    plan = read_rig_file(rig)
    made.clear()
    with Bench.of_plan(plan), Bench.of_plan(plan) as second:
        assert len(made) == 1 + 3  # one epos of the first; the reader has made the other two
        assert second["right"].get("power_off") == 0


def test_another_seed_makes_another_device(made: list[str], tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text('[device.chair]\ntype = "rrc"\n')
    run(tickrig, "run", file, "--virtual", "--for", "10ms", "--seed", "7")
    assert made == ["Rrc", "Rrc"]


def test_a_command_makes_its_device_once(made: list[str]) -> None:
    run(rrc_emu, "--scenario", "-", typed="1ms press power_button\n")
    run(canopen_slave_emu, "--model", "epos", "--scenario", "-", typed="1ms set supply_v 20\n")
    assert made == ["Rrc", "CanopenSlave"]

"""The page on campaigns: what it says is what happens."""

from __future__ import annotations

import csv
import re
import socket
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.emulators.testing.campaign.conftest import SRC, TICKRIG, Campaign
from tests.emulators.testing.campaign.test_dask import end, started
from tests.environment import ROOT, Environment
from tests.page_runner import PageRunner
from tickrig.emulators.testing.campaign.table import FIRST, LAST

PAGE = ROOT / "docs" / "reference" / "bench" / "campaign.md"

PYTEST = "import sys, pytest; from tickrig.emulators.testing.plugin import pytest_plugin as plugin"


@dataclass(frozen=True)
class Here(Environment):
    """This environment, with the commands of the tree."""

    @property
    def variables(self) -> dict[str, str]:
        """What a shell in it has."""
        own = {"PYTHONPATH": str(SRC), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "COLUMNS": "200"}
        return {**super().variables, **own}


@pytest.fixture
def runner(tmp_path: Path) -> PageRunner:
    folder = tmp_path / "bin"
    folder.mkdir()
    run = f"{PYTEST}; sys.exit(pytest.main(sys.argv[1:], [plugin]))"
    for name, program in (("tickrig", TICKRIG), ("pytest", run)):
        (folder / name).write_text(f"#!/bin/sh\nexec {sys.executable} -c '{program}' \"$@\"\n")
        (folder / name).chmod(0o755)
    (tmp_path / "work").mkdir()
    return PageRunner(Here(tmp_path), tmp_path / "work")


@pytest.mark.unmeasured
def test_its_commands_do_what_it_says(runner: PageRunner) -> None:
    runner.run(PAGE)
    assert len(runner.typed) == 7
    with (runner.folder / "campaign.csv").open(encoding="utf-8", newline="") as file:
        failed = [row["reason"] for row in csv.DictReader(file) if row["outcome"] == "failed"]
    assert len(failed) == 7
    assert "AssertionError: assert -98 in (0, 30)" in failed


def test_its_columns_are_those_of_the_table() -> None:
    rows = PAGE.read_text("utf-8").partition("| column |")[2].partition("\n\n")[0]
    assert tuple(re.findall(r"^\| `(\w+)`", rows, re.MULTILINE)) == (*FIRST, *LAST)


@pytest.mark.realtime
def test_its_cluster_works(folder: Path, tickrig: Campaign) -> None:
    (block,) = re.findall(r"^```sh\n(.*?)^```", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    here = block.replace("8786", port).replace("10.0.0.5", "127.0.0.1").replace("0-9999", "0-9")
    scheduler, worker, campaign = (line.split() for line in here.splitlines())
    quiet = ("--host", "127.0.0.1", "--no-dashboard")
    folder.joinpath("test_rrc.py").rename(folder / "test_chair.py")
    processes = [started("Scheduler at", *scheduler[1:], *quiet)[0]]
    try:
        local = ("--local-directory", str(folder / "dask"))
        processes.append(started("Registered to", *worker[1:], *quiet, *local)[0])
        tickrig(*campaign[2:], "-k", "answers", status=1)
    finally:
        for process in processes[::-1]:
            end(process)
    assert len((folder / "campaign.csv").read_text("utf-8").splitlines()) == 11

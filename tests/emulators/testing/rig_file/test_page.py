"""docs/reference/bench/rig-file.md shows the keys as they are, and what it shows happens."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from tickrig.device.body import SIDES
from tickrig.emulators.canopen.choices import MODELS
from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.rig_file.keys import BODY, PAGE
from tickrig.emulators.testing.rig_file.reader import parse_rig_file
from tickrig.host.text.section import rows

FILE = Path(__file__).parents[4] / "docs" / "reference/bench/rig-file.md"
RIGS = sorted(FILE.parents[3].glob("examples/rigs/*.toml"))
TEXT = FILE.read_text("utf-8")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("name", PAGE)
def test_a_table_of_the_page_is_the_schema(name: str) -> None:
    assert "\n".join(["", *rows(PAGE[name]), ""]) in TEXT


def test_the_models_are_those_that_there_are() -> None:
    (line,) = re.findall(r"^- the name of a CANopen model: (.*);$", TEXT, re.MULTILINE)
    assert sorted(re.findall(r"`([\w-]+)`", line)) == sorted(MODELS)


def test_the_page_of_bodies_has_the_keys_of_a_body() -> None:
    page = (FILE.parents[1] / "devices/bodies.md").read_text("utf-8")
    table = page.partition("| key | meaning |")[2].partition("\n\n")[0]
    wheels = {wheel for sides in SIDES.values() for side in sides for wheel in side}
    named = [cell.split(" | ")[0] for cell in table.splitlines()[2:]]
    assert {*re.findall(r"`(\w+)`", " ".join(named))} == {*BODY, *wheels}


@pytest.mark.parametrize("block", blocks("toml"))
def test_an_example_is_right(block: str) -> None:
    parse_rig_file(block, FILE)


def run(line: str) -> str:
    result = CliRunner().invoke(main, shlex.split(line.removeprefix("tickrig ")))
    return result.stdout + result.stderr


@pytest.mark.parametrize("block", blocks("console"))
def test_a_session_goes_as_shown(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for part in block.removeprefix("$ ").split("\n$ "):
        line, _, shown = part.strip().partition("\n")
        assert run(line).strip() == shown


def test_the_mistakes_are_those_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (wrong,), (shown,) = blocks("toml mistakes"), blocks("text mistakes")
    Path("bench.toml").write_text(wrong)
    assert run("tickrig check bench.toml") == shown


@pytest.mark.parametrize("file", RIGS, ids=[file.stem for file in RIGS])
def test_an_example_of_ours_is_right(file: Path) -> None:
    assert run(f"tickrig check {file}").startswith(f"{file}: ok: ")

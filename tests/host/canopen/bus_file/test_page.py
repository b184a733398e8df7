"""The page lists rules and keys as they are, and shows what is said."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import pytest
from click.testing import CliRunner

from tests.host.canopen.bus_file.bench import NODE, ROOT, generate, write_bus
from tickrig.emulators.commands.cli import main
from tickrig.host.canopen.bus_file.bus_file import read_bus_file
from tickrig.host.canopen.bus_file.known_keys import MASTER, OPTIONS, PDO, ROS, SLAVE
from tickrig.host.canopen.bus_file.notes import RULES

PAGE: Final = (ROOT / "docs" / "reference/canopen/bus-file.md").read_text("utf-8")


def rows_below(head: str) -> list[str]:
    """Return the rows of the first table behind a text."""
    lines = PAGE[PAGE.index(head) :].splitlines()
    begin = next(at for at, line in enumerate(lines) if line.startswith("|---"))
    end = next(at for at, line in enumerate(lines) if at > begin and not line.startswith("|"))
    return lines[begin + 1 : end]


def keys_below(head: str) -> set[str]:
    return {key for row in rows_below(head) for key in re.findall(r"`(\w+)`", row.split(" | ")[0])}


def test_the_page_has_all_rules_in_their_order() -> None:
    assert rows_below("## Rules") == [
        f"| {rule.name} | {rule.severity.value} | {rule.clause} | {rule.breaks} | {rule.fix} |"
        for rule in RULES.values()
    ]


@pytest.mark.parametrize(
    ("head", "known"),
    [
        ("## Keys of `options`", OPTIONS),
        ("## Keys of `master`", MASTER),
        ("## Keys of a node", SLAVE),
        ("| key of `rpdo` and `tpdo` |", PDO),
    ],
)
def test_the_page_has_all_keys(head: str, known: tuple[str, ...]) -> None:
    left_alone = set(re.findall(r"`(\w+)`", PAGE[PAGE.index("## Left alone") :].split("\n\n")[1]))
    assert keys_below(head) <= {*known}
    assert {*known} - keys_below(head) <= left_alone | {*ROS}
    assert left_alone <= {*MASTER, *SLAVE}


def test_the_command_of_the_page_says_what_it_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (shown,) = re.findall(r"^```console\n\$ tickrig (.*)\n([^`]*)^```", PAGE, re.MULTILINE)
    command, said = shown
    assert CliRunner().invoke(main, command.split()).output == said


def test_the_finding_of_the_page_is_what_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_bus(tmp_path, f"{NODE}  sdo:\n    - {{index: 0x6041}}\n")
    said = CliRunner().invoke(main, ["check", "bus.yml"]).output.splitlines()
    assert f"```\n{said[0]}\n```" in PAGE


def test_joints_and_others_share_what_an_anchor_has(tmp_path: Path) -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    path = write_bus(tmp_path, example)
    bus = read_bus_file(path)
    assert bus.findings == ()
    assert list(bus.slaves) == list(generate(path).slaves)
    assert [len(slave.writes) for slave in bus.slaves.values()] == [1, 0, 1]

"""System Definitions in files."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.rtc.canopen.bench import SYSTEMS
from tickrig.host.rtc.canopen.definition_reader import read_definition
from tickrig.host.rtc.canopen.definition_writer import save_definition

FIG_120 = SYSTEMS / "fig120.yaml"


def test_what_is_saved_is_read_again_also_from_another_folder(tmp_path: Path) -> None:
    definition, path = read_definition(FIG_120), tmp_path / "robot.yaml"
    save_definition(definition, SYSTEMS, path)
    again = read_definition(path)
    for one, other in zip(definition.nodes, again.nodes, strict=True):
        assert (tmp_path / other.eds).resolve() == (SYSTEMS / one.eds).resolve()
    assert again.sdo == definition.sdo


def test_a_file_that_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.mkdir()
    with pytest.raises(OSError, match="directory"):
        save_definition(read_definition(FIG_120), SYSTEMS, path)
    assert list(tmp_path.iterdir()) == [path]

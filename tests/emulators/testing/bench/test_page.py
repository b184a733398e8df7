"""The programs of docs/reference/bench/bench.md, in each of the three modes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.test_docs import blocks
from tickrig.emulators.bench.child import running
from tickrig.emulators.testing.rig_file.reader import read_rig_file

PAGE = "docs/reference/bench/bench.md"
BODY, VIRTUAL, REAL, HARDWARE, FAULTS, WARM, SEVERAL = blocks(PAGE, "python")
REAL_PORT, PLAYED = blocks(PAGE, "toml")


def run(*programs: str) -> None:
    names: dict[str, Any] = {}
    for program in programs:
        exec(compile(program, PAGE, "exec"), names)


def test_the_programs_in_virtual_time_run() -> None:
    run(BODY, VIRTUAL, FAULTS, WARM, SEVERAL)


@pytest.mark.realtime
def test_the_program_in_real_time_runs() -> None:
    run(BODY, REAL)


@pytest.mark.realtime
def test_the_program_on_hardware_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (command,) = blocks(PAGE, "console")
    assert command.strip() == "$ tickrig emu rrc --link /tmp/rrc --control /tmp/rrc.ctl"
    monkeypatch.chdir(tmp_path)
    with running("tickrig.emulators.rrc.cli") as rrc:
        rig = PLAYED.replace("/tmp/rrc.ctl", str(rrc.control)).replace("/tmp/rrc", str(rrc.link))
        (tmp_path / "rig.toml").write_text(rig, "utf-8")
        run(BODY, HARDWARE)


def test_the_rig_files_are_right(tmp_path: Path) -> None:
    for text in (REAL_PORT, PLAYED):
        (tmp_path / "rig.toml").write_text(text, "utf-8")
        hardware = read_rig_file(tmp_path / "rig.toml").hardware
        assert hardware is not None
        assert list(hardware.ports) == ["rrc"]

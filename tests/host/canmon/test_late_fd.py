"""A large log that turns out to hold CAN FD far behind its beginning: all is as frame by frame."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.columns import column_reader
from tickrig.host.canmon.sources import source as block_log

EMCY = "".join(f"({n}.000000) can0 083#3081110000000000\n" for n in range(1, 9))
FD = "(9.000000) can0 123##1AABB\n(10.000000) can0 083#3081110000000000\n"


def canmon(verb: str, path: Path) -> Result:
    name, *options = verb.split()
    return CliRunner().invoke(main, [name, str(path), *options])


@pytest.mark.parametrize(
    "verb",
    [
        "stats",
        "stats --jsonl",
        "top",
        "nodes",
        "check --no-emcy",
        "check --no-reboot",
        "graph 083[0]",
    ],
)
def test_it_is_read_again_frame_by_frame(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.log"
    path.write_text(EMCY + FD, "ascii")
    small = canmon(verb, path)
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    monkeypatch.setattr(column_reader, "BLOCK_BYTES", 100)
    large = canmon(verb, path)
    assert (large.exit_code, large.stdout, large.stderr) == (
        small.exit_code,
        small.stdout,
        small.stderr,
    )
    assert small.stdout or verb == "check --no-reboot"

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.sources import source as block_log

LOG = "".join(
    f"({n // 100}.{n % 100:02d}0000) can0 {0x181 + n % 2:03X}#{n:04X}\n" for n in range(150)
)


@pytest.fixture
def log(tmp_path: Path) -> str:
    path = tmp_path / "run.log"
    path.write_text(LOG + "what?\n", "ascii")
    return str(path)


def stats(*words: str) -> Result:
    return CliRunner().invoke(main, ["stats", *words])


def test_buses_and_identifiers_are_shown(log: str) -> None:
    result = stats(log)
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("can0: 150 frames in 1.490000 s, ")
    assert result.stdout.splitlines()[-1].split()[:4] == ["can0", "182", "75", "50.00"]
    assert "line 151 is no frame: 'what?'" in result.stderr


def test_nodes_are_shown(log: str) -> None:
    lines = stats(log, "--by", "node").stdout.splitlines()
    assert [line.split()[:4] for line in lines[-2:]] == [
        ["can0", "1", "1", "75"],
        ["can0", "2", "1", "75"],
    ]


@pytest.mark.parametrize("by", ["id", "node"])
def test_rows_are_lines_of_json(log: str, by: str) -> None:
    lines = stats(log, "--jsonl", "--by", by).stdout.splitlines()
    assert [json.loads(line)["what"] for line in lines] == ["bus", by, by]


def test_of_an_empty_log_no_line_of_json_is_printed(tmp_path: Path) -> None:
    path = tmp_path / "empty.log"
    path.touch()
    result = stats(str(path), "--jsonl")
    assert (result.exit_code, result.stdout) == (0, "")


def test_a_large_log_has_the_same_statistics(log: str, monkeypatch: pytest.MonkeyPatch) -> None:
    small = stats(log, "--jsonl")
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    large = stats(log, "--jsonl")
    assert (large.stdout, large.stderr) == (small.stdout, small.stderr)


def test_a_log_that_is_not_there_ends_with_3() -> None:
    assert stats("none.log").exit_code == 3


LIGHT = """
import sys
from tickrig.host.canmon.cli import main
try:
    main([{verb!r}, {log!r}, *{options!r}])
except SystemExit as ended:
    heavy = {{"can", "numpy", "textual", "canopen", "cantools"}} & set(sys.modules)
    sys.exit(f"{{ended.code}}, imported {{heavy}}" if ended.code or heavy else 0)
"""


@pytest.mark.parametrize(
    ("verb", "options"), [("stats", []), ("top", []), ("check", ["--nodes", "1-2", "--no-emcy"])]
)
def test_a_small_log_needs_no_heavy_library(verb: str, options: list[str], tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    log.write_text("(1.0) can0 701#05\n(1.0) can0 702#05\n", "ascii")
    program = LIGHT.format(verb=verb, log=str(log), options=options)
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    said = "judged: no-emcy, nodes\nall rules hold\n"
    assert (ran.returncode, ran.stderr) == (0, said if verb == "check" else "")

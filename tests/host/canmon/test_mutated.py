"""A small sample of mutated logs, DBC files and workspaces: whatever is in a file, no traceback.

By hand it was run over 100 000 of them.
"""

from __future__ import annotations

import gzip
import random
import re
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.columns import column_reader
from tickrig.host.canmon.sources import source as block_log
from tickrig.host.canmon.workspace import MonitorSetup, Workspace, WorkspaceError
from tickrig.host.cli.messages import Refused

TOKENS = (
    *(b"inf", b"nan", b"-1", b"1e400", b"999999999999", b"1.0", b"", b"\xff\xfe", b"\0", b"#"),
    *(b"(", b"=", b",", b"]", b"{", b'"', b"\r", b"R", b"T", b"7FF", b"20000080", b"FFFFFFFF"),
    b"1.5.5",
)
VERBS = (
    *(["info"], ["dump"], ["dump", "-t", "A", "-x"], ["dump", "--jsonl"], ["dump", "--csv"]),
    *(["stats"], ["stats", "--by", "node", "--jsonl"], ["nodes"], ["nodes", "--jsonl"], ["top"]),
    *(["check", "--no-emcy", "--nodes", "3-9", "--max-gap", "181=20ms"], ["graph", "185[0]"]),
)
TARGETS = ("out.log", "out.jsonl", "out.asc", "out.trc", "out.csv", "out.blf", "out.pcapng")
WORKSPACE = b"""\
[bus]
source = ["run.log"]
bitrate = 500000
dbc = ["engine.dbc"]
[nodes.3]
eds = "drive.eds"
[trace]
filter = "node=3"
[[transmit.row]]
send = "080#"
every = "1s"
"""


def mutated(chance: random.Random, text: bytes) -> bytes:
    """Return a text with one to four changes of bytes, numbers, words and lines."""
    lines = text.split(b"\n")
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(lines))
        line = lines[at]
        match chance.randrange(5):
            case 0:
                lines[at] = lines[chance.randrange(len(lines))]
            case 1:
                cut = chance.randint(0, len(line))
                lines[at] = line[:cut] + bytes([chance.randrange(256)]) + line[cut + 1 :]
            case 2:
                lines[at] = line[: chance.randint(0, len(line))]
            case 3:
                return re.sub(rb"\d+\.\d+", chance.choice(TOKENS), b"\n".join(lines))
            case _:
                words = re.split(rb"([\s,;#().=:\[\]]+)", line)
                words[chance.randrange(len(words))] = chance.choice(TOKENS)
                lines[at] = b"".join(words)
    return b"\n".join(lines)


def run(*words: object) -> str:
    """Run canmon; what is no exit of its own is raised."""
    result = CliRunner().invoke(main, [str(word) for word in words], catch_exceptions=False)
    assert 0 <= result.exit_code <= 5
    return result.output


FD = b"""\
(1600000003.000000) can0 185##1%s
(1600000003.001000) can0 18FF0001##5%s
(1600000003.002000) can0 705##0
""" % (b"5A" * 64, b"00" * 12)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, bytes]]:
    """Return the beginning of a log in each format, and on screens."""
    folder = tmp_path_factory.mktemp("logs")
    first = folder / "first.log"
    frames = (GOLDEN / "drive.log").read_bytes().splitlines(True)[:25]
    first.write_bytes(b"".join(frames) + FD)
    found = []
    for name in TARGETS:
        run("conv", first, folder / name)
        found.append((name, (folder / name).read_bytes()))
    screens = (run("dump", first, *words).encode() for words in (["-t", "d"], ["-t", "A", "-x"]))
    return found + [("screen.txt", screen) for screen in screens]


@pytest.mark.parametrize("seed", [11, 41, 63, 107, 149, 175, 181, 216])
def test_a_mutated_log_is_no_traceback(
    seed: int, logs: list[tuple[str, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chance = random.Random(seed)
    monkeypatch.setattr(block_log, "SMALL_BYTES", chance.choice((0, 1 << 20)))
    for name, content in logs:
        (path := tmp_path / name).write_bytes(mutated(chance, content))
        run(*(words := chance.choice(VERBS))[:1], path, *words[1:])
        run("conv", path, tmp_path / f"to_{chance.choice(TARGETS)}")


LARGE = (
    *VERBS[5:10],
    ["check", "--no-emcy", "--no-reboot", "--max-gap", "185=20ms", "--nodes", "5"],
)
MORE = b"""\
(1600000002.000000) can0 705#05
(1600000002.001000) can1 085#1081110000000000
(1600000002.002000) can0 20000004#0020000000006080
(1600000002.003000) can0 18FF0001#0102
(1600000002.004000) can1 705#R
(1600000002.100000) can0 705#05 R
"""


@pytest.mark.parametrize("seed", range(20))
def test_a_mutated_log_in_blocks_is_as_frame_by_frame(
    seed: int, logs: list[tuple[str, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chance, path = random.Random(seed), tmp_path / "run.log"
    content = mutated(chance, logs[0][1] + MORE)
    verb, *options = chance.choice(LARGE)
    if chance.random() < 0.2:
        path, packed = tmp_path / "run.log.gz", gzip.compress(content, 1, mtime=0)
        content = packed[: chance.randrange(len(packed))] if chance.random() < 0.5 else packed
    path.write_bytes(content)
    small = CliRunner().invoke(main, [verb, str(path), *options], catch_exceptions=False)
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    monkeypatch.setattr(column_reader, "BLOCK_BYTES", chance.choice((1, 300, 1 << 20)))
    large = CliRunner().invoke(main, [verb, str(path), *options], catch_exceptions=False)
    assert (large.exit_code, large.output) == (small.exit_code, small.output)


def test_a_mutated_dbc_file_is_no_traceback(tmp_path: Path) -> None:
    chance, path, log = random.Random(0), tmp_path / "run.dbc", tmp_path / "run.log"
    log.write_text("(1.0) can0 123#E8030100\n(1.1) can0 18FF0001#25\n(1.2) can0 123#01\n")
    for _ in range(15):
        path.write_bytes(mutated(chance, (GOLDEN / "engine.dbc").read_bytes()))
        run("dump", log, "--dbc", path)


def test_a_mutated_workspace_is_no_traceback() -> None:
    chance = random.Random(0)
    for _ in range(30):
        text = mutated(chance, WORKSPACE).decode("utf-8", "replace")
        with suppress(WorkspaceError, Refused):
            MonitorSetup.read(Workspace(text, Path("bench.toml")))

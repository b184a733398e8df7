"""What is written on a full disk: an error that names file and cause, and the file of before."""

from __future__ import annotations

import ast
import errno
import os
import re
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.device.canopen.reference import make_dictionary
from tests.emulators.testing.campaign.test_table import TABLE
from tests.emulators.testing.report.test_report_json import REPORT
from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR
from tickrig.emulators.canopen.cli import main as canopen_slave_emu
from tickrig.emulators.canopen.store_file import StoreFile
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rh3.commands.motion_cli import main as rh3
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.campaign.table import write_table
from tickrig.emulators.testing.report.report_file import write_run
from tickrig.host.canmon.cli import main as canmon
from tickrig.host.canmon.workspace import Workspace, WorkspaceError
from tickrig.host.cli.messages import Refused
from tickrig.host.rtc.canopen.commands.builder import main as rtc_canopen_builder
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.definition_writer import save_definition
from tickrig.host.rtc.system.system_file import write_system
from tickrig.host.text.whole_file import replacing, write_whole

ROOT = Path(__file__).parents[1]
PROGRAMS = {
    "canmon": canmon,
    "canopen-slave-emu": canopen_slave_emu,
    "rh3": rh3,
    "rtc-canopen-builder": rtc_canopen_builder,
    "tickrig": tickrig,
}
BEFORE = "what was there before\n"
LOG = "".join(f"({n}.000000) can0 185#{n:04X}\n" for n in range(200))

LINES = {
    "canopen-slave-emu --model rtc-echo --write-eds out.eds": "out.eds",
    **{
        f"canmon conv a.log out{suffix}": f"out{suffix}"
        for suffix in (
            ".log",
            ".log.gz",
            ".jsonl",
            ".csv",
            ".asc",
            ".trc",
            ".blf",
            ".pcapng",
            ".trace",
        )
    },
    "canmon check a.log --no-emcy --junit out.xml": "out.xml",
    "canmon check a.log --no-emcy --sarif out.sarif": "out.sarif",
    **{
        f"canmon graph a.log 185[0:2] -o out{suffix}": f"out{suffix}"
        for suffix in (
            ".svg",
            ".html",
            ".csv",
            ".png",
        )
    },
    "canmon eds check in.eds --junit out.xml": "out.xml",
    "canmon eds fix in.eds -o out.eds": "out.eds",
    "canmon conform rig.toml --node 5 --only UE-01 --junit out.xml": "out.xml",
    "canmon conform rig.toml --node 5 --only UE-01 --html out.html": "out.html",
    "canmon conform rig.toml --node 5 --only UE-01 --badge out.svg": "out.svg",
    "canmon conform rig.toml --node 5 --only UE-01 --write-baseline out.txt": "out.txt",
    "tickrig init -o new.toml": "new.toml",
    "tickrig new device lamp": "lamp",
    "tickrig demo fig120 --plot out.svg": "out.svg",
    "rh3 goto 0.1 0 0 --plot out.png": "out.png",
    "tickrig run rig.toml --virtual --for 1s --plot node_id -o out.csv": "out.csv",
    "tickrig run rig.toml --virtual --for 1s --plot node_id -o out.svg": "out.svg",
    "tickrig run rig.toml --virtual --for 1s --report out.html": "out.html",
    "tickrig campaign merge a.csv -o out.csv": "out.csv",
    "tickrig campaign merge a.csv -o out.parquet": "out.parquet",
    "tickrig report run.json -o out.html": "out.html",
    "rtc-canopen-builder profile.toml --out . --force": "gripper.eds",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.log").write_text(LOG, "ascii")
    shutil.copy(ROOT / "examples" / "eds" / "f-palette.eds", "in.eds")
    (tmp_path / "rig.toml").write_text('[device.io]\ntype = "f-palette"\nnode_id = 5\n', "utf-8")
    profile = CliRunner().invoke(rtc_canopen_builder, ["--example"]).stdout
    (tmp_path / "profile.toml").write_text(profile, "utf-8")
    write_table(TABLE, tmp_path / "a.csv")
    write_run(REPORT, tmp_path / "run.json")
    return tmp_path


@contextmanager
def full_disk() -> Iterator[None]:
    """Let no file take a byte: the kernel refuses it as it does where a disk is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize("line", LINES)
def test_a_command_says_so_and_leaves_what_was_there(line: str, folder: Path) -> None:
    program, *words = line.split()
    out, new = folder / LINES[line], " new" in line or " init" in line
    if not new:
        out.write_text(BEFORE, "ascii")
    before = files(folder)
    with full_disk():
        result = CliRunner().invoke(PROGRAMS[program], words)
    assert result.exit_code not in (0, 1), result.output
    last = result.stderr.splitlines()[-1]
    assert LINES[line] in last
    assert os.strerror(errno.EFBIG) in last
    assert files(folder) == before
    assert not new or not out.exists()
    again = CliRunner().invoke(PROGRAMS[program], words)
    assert again.exit_code == (1 if "merge" in line else 0), again.output
    assert new or out.read_bytes() != BEFORE.encode()


def save_workspace(path: Path) -> None:
    workspace = Workspace.read(path)
    workspace.put("trace", {"overwrite": True})
    workspace.write()


def save_store(path: Path) -> None:
    store = StoreFile(path.with_name("none"))
    store.path = path
    store.nonvolatile("5", make_dictionary()).changed()
    store.save()


def save_trace(path: Path) -> None:
    with Bench("rrc") as bench:
        bench.run_for("10ms")
        bench.save_trace(path)


def save_system(path: Path) -> None:
    write_system("# a system\n", path)


def save_nodes(path: Path) -> None:
    save_definition(parse_definition(PALETTE_AND_MOTOR), path.parent, path)


@pytest.mark.parametrize("save", [save_workspace, save_store, save_trace, save_system, save_nodes])
def test_what_is_saved_while_a_program_runs_is_as_it_was(
    save: Callable[[Path], None], tmp_path: Path
) -> None:
    path = tmp_path / "file.toml"
    path.write_text("# before\n", "ascii")
    with full_disk(), pytest.raises((OSError, Refused, WorkspaceError)) as refused:
        save(path)
    assert files(tmp_path) == {"file.toml": b"# before\n"}
    assert str(path) in str(refused.value)
    assert os.strerror(errno.EFBIG) in str(refused.value)
    save(path)
    assert path.read_text("utf-8") != "# before\n"


def test_a_real_disk_that_is_full_does_not_harm_the_file(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    if (
        not shutil.which("mount")
        or subprocess.run(mount, check=False, capture_output=True).returncode
    ):
        pytest.skip("no file system can be mounted here")
    try:
        path = disk / "out.eds"
        path.write_text(BEFORE, "ascii")
        with suppress(OSError), (disk / "filler").open("wb", buffering=0) as filler:
            while filler.write(bytes(4_096)):
                pass
        words = ["--model", "rtc-echo", "--write-eds", str(path)]
        result = CliRunner().invoke(canopen_slave_emu, words)
        assert (result.exit_code, result.stderr) == (
            2,
            f"Error: EDS {path}: No space left on device\n",
        )
        assert sorted(each.name for each in disk.iterdir()) == ["filler", "out.eds"]
        assert path.read_text("ascii") == BEFORE
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_a_file_keeps_its_mode_and_a_link_its_target(tmp_path: Path) -> None:
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_text(BEFORE)
    path.chmod(0o640)
    link.symlink_to("file")
    write_whole(link, "new")
    assert link.is_symlink()
    assert (path.read_text(), path.stat().st_mode & 0o777) == ("new", 0o640)


def test_what_fails_within_leaves_the_file_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text(BEFORE)

    def write() -> None:
        with replacing(path) as beside:
            beside.write_text("half")
            raise ValueError("oh")

    with pytest.raises(ValueError, match="oh"):
        write()
    assert files(tmp_path) == {"file": BEFORE.encode()}


def test_a_device_is_written_to() -> None:
    write_whole(Path("/dev/null"), "text")
    with pytest.raises(OSError, match="No space left on device") as full:
        write_whole(Path("/dev/full"), "text")
    assert full.value.filename == "/dev/full"


STREAMS = {
    "emulators/bench/child.py": "what a child process says, while it runs",
    "emulators/record/recorder.py": "a recording",
    "emulators/serial/pty_port.py": "a lock",
    "emulators/testing/campaign/journal.py": "verdicts as they come, one line each",
    "emulators/testing/campaign/worker.py": "/dev/null",
    "host/cli/start.py": "standard streams that were closed",
    "host/canmon/model/logs/log_file.py": "a recording, or a new file of `whole_log`",
    "host/canmon/model/recorder/files.py": "the index of a recording",
    "host/rtc/canopen/commands/opening.py": "events as they come",
    "host/text/whole_file.py": "a recording",
}
"""Modules that open files for writing themselves, and why."""

WHOLE = ("beside", "picture", "drawing", "savefig(file")
"""What is in a call that writes a new file, or into memory."""

OPENED = re.compile(r"""["'][wxa]b?["']|O_CREAT|\bmode\b""")
WRITING = re.compile(r"\.(write_text|write_bytes|savefig)$")
MAY_WRITE = re.compile(r"\bopen\(|\.write_(text|bytes)\(|\.savefig\(")


def writes(path: Path) -> bool:
    """Say whether a module writes files past `write_whole` and `replacing`."""
    text = path.read_text("utf-8")
    if not MAY_WRITE.search(text):
        return False
    for call in ast.walk(ast.parse(text)):
        if isinstance(call, ast.Call):
            name, said = ast.unparse(call.func), ast.unparse(call)
            opens = name.split(".")[-1] == "open" and OPENED.search(said)
            if (opens or WRITING.search(name)) and not any(word in said for word in WHOLE):
                return True
    return False


def test_files_are_written_whole_everywhere() -> None:
    found = {
        str(path.relative_to(ROOT))
        for floor in ("emulators", "host")
        for path in (ROOT / floor).rglob("*.py")
        if writes(path)
    }
    assert found == STREAMS.keys()

"""`canmon net program` on rigs in virtual time: into the boot loader of f-palette-boot."""

from __future__ import annotations

from binascii import crc32
from pathlib import Path

import pytest
from click.testing import Result

from tests.host.canmon.net.test_net_verbs import net, written
from tickrig.device.canopen.models.f_palette_boot import make_f_palette_boot
from tickrig.emulators.testing.conformance.conformance import SlaveBench
from tickrig.host.canmon.net import session
from tickrig.host.canmon.net.program_verb import ProgressBar
from tickrig.wire.can import CanFrame

RIG = """\
[device.module]
type = "f-palette-boot"
node_id = 17
"""
FIRMWARE = bytes(range(256)) * 40
ID = f"{crc32(FIRMWARE):08X}"


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "firmware.bin"
    path.write_bytes(FIRMWARE)
    return str(path)


def test_firmware_is_downloaded_and_runs(rig: str, file: str) -> None:
    result = net(rig, "program", "17", file, "--expect", ID)
    assert result.exit_code == 0, result.output
    before, after = result.stdout.splitlines()
    assert before.startswith("node 17: running; identification F18AE307h")
    assert after == f"node 17: running; identification {ID}h; flash: no error"
    assert result.stderr.splitlines() == [
        "10240 bytes of firmware.bin into program 1 of node 17."
        " The program stops: a drive releases its motor, a hanging load may fall",
        "node 17: stopped: the boot loader runs",
        "node 17: cleared",
        "10240 bytes written",
        "node 17: started",
    ]


def test_a_dry_run_downloads_nothing(rig: str, file: str, sent: list[CanFrame]) -> None:
    result = net(rig, "program", "17", file, "--dry-run")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[1:] == [
        "not done: 1F51h:01 program control = 0 (stop)",
        "not done: 1F51h:01 program control = 3 (clear)",
        "not done: 1F50h:01 program data = 10240 bytes",
        "not done: 1F51h:01 program control = 1 (start)",
    ]
    command = net(rig, "program", "17", "--control", "stop", "--dry-run")
    assert command.stdout == "not done: 1F51h:01 program control = 0 (stop)\n"
    assert not written(sent)
    shown = net(rig, "program", "17", "--dry-run")
    assert (shown.exit_code, "give FILE or --control" in shown.stderr) == (2, True)


def test_over_a_line_with_1_percent_corrupted_frames_too(rig: str, file: str) -> None:
    with Path(rig).open("a") as opened:
        opened.write('[fault]\ncan = "corrupt=0.01"\n')
    result = net(rig, "program", "17", file, "--expect", ID)
    assert result.exit_code == 0, result.output


class Module:
    """One module that outlives a call."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.slave = make_f_palette_boot(17)
        source = SlaveBench(self.slave, 1_000_000).source
        monkeypatch.setattr(session, "open_conform_source", lambda *words: source)

    def net(self, *words: str) -> Result:
        return net("its-bus", "program", "17", *words)


def test_what_is_there_already_is_not_downloaded(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = Module(monkeypatch)
    assert module.net(file).exit_code == 0
    version = module.slave.nonvolatile.version
    result = module.net(file, "--expect", f"0x{ID}")
    assert (result.exit_code, module.slave.nonvolatile.version) == (0, version)
    assert "it runs what is expected; nothing is to be done" in result.stderr


def test_an_end_in_the_middle_says_so_and_the_same_command_goes_on(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = Module(monkeypatch)

    def press(bar: ProgressBar, done: int) -> None:
        if done > len(FIRMWARE) // 2:
            raise KeyboardInterrupt

    with monkeypatch.context() as pressed:
        pressed.setattr(ProgressBar, "take", press)
        result = module.net(file)
    assert result.exit_code == 130
    assert result.stderr.splitlines()[-1] == (
        "interrupted; done: stop, clear; not done: download, identification, start; the node has"
        " no whole program; a transfer cannot go on in its middle: the same command starts it again"
    )
    assert module.net().stdout == (
        "node 17: stopped; identification 00000000h; flash: no valid program\n"
    )
    again = module.net(file, "--expect", ID)
    assert again.exit_code == 0, again.output
    assert "node 17: it is already stopped" in again.stderr


def test_a_node_that_dies_in_the_middle_is_told(rig: str, file: str) -> None:
    with Path(rig).open("a") as opened:
        opened.write('[fault]\nmodule = "power_off@450ms"\n')
    result = net(rig, "program", "17", file, "--tries", "2")
    assert result.exit_code == 1
    assert "begun anew" not in result.stderr, "nobody answers"
    told = result.stderr.splitlines()[-1]
    assert "Error: node 17: 1F50h:01 program data: no answer within 10000 ms" in told
    assert "the node has no whole program" in told


def test_its_program_is_commanded_alone(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module = Module(monkeypatch)
    states = [module.net("--control", word).stdout for word in ("stop", "clear", "start", "stop")]
    assert states == [
        "node 17: stopped; identification F18AE307h; flash: no error\n",
        "node 17: stopped; identification 00000000h; flash: no valid program\n",
        "",
        "node 17: stopped; identification 00000000h; flash: no valid program\n",
    ]
    assert module.net(file, "--no-start").stdout.endswith(
        f"node 17: stopped; identification {ID}h; flash: no error\n"
    )
    result = module.net("--control", "start")
    assert result.stdout.startswith("node 17: running")
    assert "This may turn a motor: the program runs" in result.stderr


def test_the_bar_says_how_far_it_is_and_how_fast() -> None:
    now_us = 0
    bar = ProgressBar(10_000, lambda: now_us)
    assert bar._line(0) == f"[{'.' * 30}]   0%  0 of 10000 bytes"
    now_us = 2_000_000
    assert bar._line(5_000) == (
        f"[{'#' * 15}{'.' * 15}]  50%  5000 of 10000 bytes  2.5 kB/s  2 s left"
    )


@pytest.mark.parametrize(
    ("words", "status", "why"),
    [
        (("17", "nosuch.bin"), 2, "FILE nosuch.bin: No such file"),
        (("17", "/dev/null"), 2, "FILE /dev/null: it is empty"),
        (("17", "{file}", "--expect", "xyz"), 2, "'xyz' is no identification of up to 8 hex"),
        (("17", "{file}", "--control", "stop"), 2, "FILE or --control: which? give one"),
        (("17", "{file}", "--expect", "12"), 1, f"is {ID}h, 00000012h was expected"),
        (("17", "--number", "2"), 1, "1F51h:02 program control: refused: sub-index does not"),
        (("17", "--control", "clear"), 1, "refused: not possible in this device state"),
    ],
)
def test_what_cannot_be_is_one_line(
    rig: str, file: str, words: tuple[str, ...], status: int, why: str
) -> None:
    result = net(rig, "program", *(word.format(file=file) for word in words))
    assert result.exit_code == status, result.output
    (told,) = (line for line in result.stderr.splitlines() if line.startswith("Error:"))
    assert why in told

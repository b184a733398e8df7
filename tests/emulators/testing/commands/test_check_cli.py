from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from click.testing import CliRunner

from tickrig.device.canopen.ds402.axis import IdealMotor
from tickrig.emulators.testing.commands.check_cli import check

ROOT = Path(__file__).parents[4]
GOOD = '[device.rrc]\ntype = "rrc"\n[wire.can0]\ntype = "can"\nbitrate = 500000\n'
GOOD += '[device.left]\ntype = "epos"\nnode_id = "lss"\n[device.base]\ntype = "rh3-base"\n'


def run(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(check, words)
    return result.exit_code, result.stdout, result.stderr


def test_a_good_file_is_summed_up(folder: Path) -> None:
    (folder / "rig.toml").write_text(GOOD)
    assert run("rig.toml") == (
        0,
        "rig.toml: ok: 3 devices, 3 wires\n"
        "  can0  CAN 500000 bit/s: left (epos, waits for LSS)\n"
        "  rrc   serial line: rrc (rrc)\n"
        "  base  serial line: base (rh3-base)\n",
        "",
    )


def test_where_wires_are_is_summed_up(folder: Path) -> None:
    (folder / "rig.toml").write_text(
        GOOD + '[real]\nrrc = { link = "rrc.pty", serve = "socket://7000" }\n'
        'can0.interface = "socketcan"\n[hardware]\nrrc.port = "/dev/ttyACM0"\n'
        'can0 = { interface = "slcan", channel = "COM3" }\n'
    )
    assert run("rig.toml")[1].splitlines() == [
        "rig.toml: ok: 3 devices, 3 wires, hardware",
        "  can0  CAN 500000 bit/s: left (epos, waits for LSS)",
        "        real: socketcan; hardware: slcan COM3",
        "  rrc   serial line: rrc (rrc)",
        "        real: rrc.pty, socket://7000; hardware: /dev/ttyACM0",
        "  base  serial line: base (rh3-base)",
        "        hardware: not said where",
    ]


BODY = """
[device.left]
type = "drive.eds"
node_id = 1
[device.right]
type = "epos"
node_id = 2
[body]
kind = "differential"
left = "left"
right = "right"
wheel_radius_m = 0.08
tread_m = 0.33
"""


def test_ideal_motors_of_a_body_are_named(folder: Path) -> None:
    shutil.copy(ROOT / "examples/eds/epos.eds", folder / "drive.eds")
    (folder / "a.toml").write_text(BODY)
    assert run("a.toml") == (
        0,
        "a.toml: ok: 2 devices, 1 wire, 1 body\n"
        "  can   CAN: left (drive.eds, node-ID 1), right (epos, node-ID 2)\n"
        f"  body  ideal motor of left: no load, no gear, {IdealMotor.counts_per_turn} counts in a"
        " turn of the wheel\n",
        "",
    )
    (folder / "a.toml").write_text(BODY.replace('"epos"', '"drive.eds"'))
    assert "  body  ideal motors of left, right: no load" in run("a.toml")[1]
    (folder / "a.toml").write_text(BODY.replace('"drive.eds"', '"epos"'))
    assert "ideal" not in run("a.toml")[1]


def test_all_mistakes_of_all_files_are_told(folder: Path) -> None:
    (folder / "a.toml").write_text(GOOD.replace('"epos"', '"eops"').replace("rrc]", "r-c]"))
    (folder / "b.toml").write_bytes(b"\n\xff")
    (folder / "c.toml").write_text(GOOD)
    status, out, _ = run("a.toml", "b.toml", "c.toml")
    assert status == 1
    assert out.splitlines()[:4] == [
        "a.toml:1: device.r-c: a name is letters, digits and _, a letter first, as r_c",
        "a.toml:7: device.left.type: no device 'eops'; did you mean 'epos'?"
        " (or an EDS or DCF file, FILE.py:Class)",
        "b.toml:2: the byte 0xff is no UTF-8: a rig file is a text",
        "c.toml: ok: 3 devices, 3 wires",
    ]


def test_a_file_that_cannot_be_read_is_told_and_the_others_are_checked(folder: Path) -> None:
    (folder / "rig.toml").write_text(GOOD)
    status, out, err = run("nowhere.toml", ".", "rig.toml")
    assert (status, out.splitlines()[0]) == (2, "rig.toml: ok: 3 devices, 3 wires")
    assert err == ("Error: nowhere.toml: No such file or directory\nError: .: Is a directory\n")


def test_an_eds_has_a_check_of_its_own(folder: Path) -> None:
    (folder / "a.eds").write_text("[FileInfo]\n")
    status, out, err = run("a.eds")
    assert (status, out) == (2, "")
    assert err == "Error: a.eds: an EDS, no rig file or bus.yml; use: canmon eds check a.eds\n"


def test_a_reader_that_has_gone_is_no_error(folder: Path) -> None:
    (folder / "rig.toml").write_text(GOOD)
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as out:
        program = [sys.executable, "-m", "tickrig", "check", "rig.toml"]
        ended = subprocess.run(program, cwd=folder, stdout=out, stderr=subprocess.PIPE, check=False)
    assert ended.stderr == b""


def test_a_system_definition_has_a_check_of_its_own(folder: Path) -> None:
    (folder / "beego.yaml").write_text("nodes:\n- {id: 1, eds: a.eds}\n")
    status, out, err = run("beego.yaml")
    check = "a System Definition; use: rtc-canopen-server --check beego.yaml"
    assert (status, out, err) == (
        2,
        "",
        f"Error: beego.yaml: no rig file or bus.yml, but {check}\n",
    )


def test_at_least_one_file_is_wanted() -> None:
    assert run()[0] == 2

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hil.rrc.rig_file import BadRigFile, RigFile, read_rig_file

PORT = '[dut.rrc]\nport = "/dev/ttyACM0"\n'


@pytest.fixture
def rig_toml(tmp_path: Path) -> Path:
    return tmp_path / "rig.toml"


def test_a_port_is_enough(rig_toml: Path) -> None:
    rig_toml.write_text(PORT)
    assert read_rig_file(str(rig_toml)) == RigFile("/dev/ttyACM0")


def test_all_of_it_is_read(rig_toml: Path) -> None:
    rig_toml.write_text(
        PORT + '[tolerance]\nstick_pct = 5\ntime_ms = 20\n[operator]\ncontrol = "rrc.ctl"\n'
    )
    assert read_rig_file(str(rig_toml)) == RigFile("/dev/ttyACM0", 5, 20_000, Path("rrc.ctl"))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", 'needs a port, as port = "/dev/ttyACM0"'),
        ("[dut.rrc", "Expected ']'"),
        ("[dut]\nrrc = 3\n", "[dut.rrc] is not a table"),
        ("[dut.rcc]\n", "[dut] has no 'rcc'; known: rrc"),
        ("[dut.rrc]\nport = 3\n", "[dut.rrc] port is 3, a text is needed"),
        (PORT + "baud = 9600\n", "[dut.rrc] has no 'baud'; known: port"),
        (PORT + "[tolerances]\n", "the file has no 'tolerances'; known: dut, tolerance, operator"),
        (PORT + "[tolerance]\nstick_pct = 51\n", "stick_pct is 51, a whole number 0..50 is needed"),
        (PORT + "[tolerance]\ntime_ms = true\n", "time_ms is True, a whole number 0..1000"),
        (PORT + "[operator]\ncontrol = 1\n", "[operator] control is 1, a text is needed"),
        (PORT + '[operator]\nname = "me"\n', "[operator] has no 'name'; known: control"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(rig_toml: Path, text: str, complaint: str) -> None:
    rig_toml.write_text(text)
    with pytest.raises(BadRigFile) as caught:
        read_rig_file(str(rig_toml))
    assert str(caught.value).startswith(f"{rig_toml}: ")
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(rig_toml: Path) -> None:
    with pytest.raises(BadRigFile, match=r"rig\.toml: No such file or directory"):
        read_rig_file(str(rig_toml))


def test_a_file_that_is_no_text_is_named(rig_toml: Path) -> None:
    rig_toml.write_bytes(b"\xff")
    with pytest.raises(BadRigFile, match=r"rig\.toml: .*utf-8"):
        read_rig_file(str(rig_toml))

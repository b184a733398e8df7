"""What the shell completes: names of a running emulator, and faults before one runs."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.shell_completion import BashComplete
from click.testing import CliRunner

from tests.emulators.lamp import Lamp
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.canopen.choices import MODELS
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.cli.start import load
from tickrig.host.control.server import ControlServer

WIRE = " ".join(BYTE_FAULTS)
MAINS = {
    "rrc-emu": "tickrig.emulators.rrc.cli:main",
    "rh3-emu": "tickrig.emulators.rh3.cli:main",
    "urg-emu": "tickrig.emulators.urg.cli:main",
    "ucode-reader-emu": "tickrig.emulators.tkernel.reader.cli:main",
    "rtc-lite-emu": "tickrig.emulators.rtc_lite.cli:main",
    "canopen-slave-emu": "tickrig.emulators.canopen.cli:main",
    "tickrig": "tickrig.emulators.commands.cli:main",
}


TYPES = "rrc rtc-lite rh3-base urg ucode-reader"


def completed(line: str) -> str:
    command, *words = line.split(" ")
    shell = BashComplete(load(MAINS[command]), {}, command, "")
    return " ".join(item.value for item in shell.get_completions(words[:-1], words[-1]))


@pytest.fixture
def lamp(tmp_path: Path) -> Iterator[Path]:
    """Serve the control socket of a lamp."""
    server, done = (
        ControlServer(tmp_path / "ctl", EmulatorControl(Emulator("lamp", Lamp()))),
        [False],
    )

    def serve() -> None:
        while not done[0]:
            server.serve(1_000)

    thread = threading.Thread(target=serve)
    thread.start()
    yield tmp_path / "ctl"
    done[0] = True
    thread.join()
    server.close()


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("press ", "key"),
        ("press x", ""),
        ("set ", "place lamp key x_mm y_mm dead"),
        ("set x", "x_mm"),
        ("fault ", f"{WIRE} dead"),
        ("fault d", "drop dup delay dead"),
        ("clear cu", "cut"),
        ("get ", "lamp key x_mm y_mm dead state count"),
        ("get state c", "count"),
    ],
)
def test_names_of_a_running_emulator_are_completed(lamp: Path, words: str, names: str) -> None:
    assert completed(f"tickrig ctl {lamp} {words}") == names


def test_without_an_emulator_nothing_is_completed(tmp_path: Path) -> None:
    assert completed(f"tickrig ctl {tmp_path}/nobody press ") == ""


@pytest.mark.parametrize(
    "line",
    [
        *("rrc-emu", "rh3-emu", "urg-emu", "rtc-lite-emu", "ucode-reader-emu"),
        *(f"canopen-slave-emu --node-id 5 --model {name}" for name in MODELS),
    ],
)
def test_faults_are_completed_as_they_are_known(line: str) -> None:
    command, *words = f"{line} --scenario - --fault nothing".split()
    refused = CliRunner().invoke(load(MAINS[command]), words).stderr
    known = refused.rstrip().partition("known: ")[2].split(", ")
    of_all = [name for name in known if "/" not in name]  # 5/drop is drop of one node
    assert sorted(completed(f"{line} --fault ").split()) == sorted(of_all)


def test_faults_of_every_node_are_completed() -> None:
    assert completed("canopen-slave-emu --eds a.eds --fault po") == "power_off"


@pytest.mark.parametrize("verb", ["record /dev/ttyUSB0", "compare run.trace"])
def test_device_types_are_completed(verb: str) -> None:
    assert completed(f"tickrig {verb} --type ").startswith(TYPES)
    assert completed(f"tickrig {verb} --type rt") == "rtc-lite"

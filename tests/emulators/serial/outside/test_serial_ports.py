from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import pytest
import serial

from tests.emulators.serial.outside.lines import BAUD, OpenLine
from tickrig.emulators.serial.outside.serial_ports import HANDLERS, SERIAL_PORTS, register_handler
from tickrig.emulators.serial.outside.serial_side import SerialSide


@pytest.fixture
def side() -> SerialSide:
    bench = OpenLine()
    bench.port.close()
    return bench.side


@pytest.fixture
def url(side: SerialSide) -> Iterator[str]:
    with SERIAL_PORTS.offer("rrc", side):
        yield "tickrig://rrc"
    assert SERIAL_PORTS.names == ()


def test_a_line_is_opened_by_its_name(url: str, side: SerialSide) -> None:
    with serial.serial_for_url(url, baudrate=BAUD, timeout=0.5) as port:
        assert (port.name, port.port, port.is_open) == (url, url, True)
        assert (port.read(), side.rig.now_us) == (b"", 500_000)
    assert not port.is_open


def test_positional_settings_are_those_of_pyserial(url: str) -> None:
    port = serial.serial_for_url(url, 57_600, 7, "E", 2, 0.25)
    assert (port.baudrate, port.bytesize, port.parity) == (57_600, 7, "E")
    assert (port.stopbits, port.timeout) == (2, 0.25)


def test_it_may_be_opened_later_and_again(url: str) -> None:
    port = serial.serial_for_url(url, baudrate=BAUD, do_not_open=True)
    assert not port.is_open
    for _ in range(2):
        port.open()
        port.close()
    with port:
        assert port.is_open


def test_an_unknown_name_tells_the_known_ones(url: str, side: SerialSide) -> None:
    with pytest.raises(
        serial.SerialException,
        match=r"could not open port tickrig://nix: no rig offers it; known: tickrig://rrc$",
    ):
        serial.serial_for_url("tickrig://nix")
    with (
        SERIAL_PORTS.offer("left", side),
        pytest.raises(serial.SerialException, match=r"'.*://left'"),
    ):
        serial.serial_for_url("tickrig://Left")


def test_without_any_name_it_says_so() -> None:
    register_handler()
    with pytest.raises(serial.SerialException, match="no rig offers it; known: none"):
        serial.serial_for_url("tickrig://rrc")


@pytest.mark.parametrize("url", ["tickrig://", "tickrig://rrc?", "tickrig://rrc?baud=3"])
def test_a_wrong_url_tells_the_form(url: str, side: SerialSide) -> None:
    with SERIAL_PORTS.offer("rrc", side):
        if url.endswith("?"):
            serial.serial_for_url(url, baudrate=BAUD)
            return
        with pytest.raises(serial.SerialException, match=r"expected is tickrig://NAME or tickrig:"):
            serial.serial_for_url(url)


def test_a_setting_that_differs_is_refused_if_the_url_says_so(url: str, side: SerialSide) -> None:
    with pytest.raises(
        serial.SerialException, match=r"is set to 9600 8N1, the device has 100000 8N1"
    ):
        serial.serial_for_url(f"{url}?mismatch=refuse")
    assert not side.in_use
    serial.serial_for_url(f"{url}?mismatch=refuse", baudrate=BAUD).close()
    side.mismatch = "refuse"
    serial.serial_for_url(f"{url}?mismatch=errors").close()
    with pytest.raises(serial.SerialException, match="is set to 9600 8N1"):
        serial.serial_for_url(url)


@pytest.mark.parametrize("name", ["", "a b", "a?b", "a#b", "a\nb"])
def test_a_name_that_no_url_has_is_refused(name: str, side: SerialSide) -> None:
    with (
        pytest.raises(ValueError, match="cannot be in a URL"),
        SERIAL_PORTS.offer(name, side),
    ):
        pass


def test_a_name_is_offered_once(url: str, side: SerialSide) -> None:
    with (
        pytest.raises(ValueError, match="tickrig://rrc is offered already"),
        SERIAL_PORTS.offer("rrc", side),
    ):
        pass


def test_the_handler_is_registered_once() -> None:
    for _ in range(3):
        register_handler()
    assert serial.protocol_handler_packages.count(HANDLERS) == 1


PROGRAM = """
{imports}
try:
    serial.serial_for_url("tickrig://rrc")
except Exception as error:
    print(type(error).__name__, error)
"""


@pytest.mark.parametrize(
    ("imports", "told"),
    [
        ("import serial; import tickrig", "SerialException could not open port tickrig://rrc: no "),
        ("import tickrig; import serial", "ValueError invalid URL, protocol 'tickrig' not known"),
        (
            "import serial; serial.protocol_handler_packages.append("
            "'tickrig.emulators.serial.outside')",
            "SerialException could not open port tickrig://rrc: no rig offers it; known: none",
        ),
        (
            "import tickrig; import serial; tickrig.SERIAL_PORTS",
            "ValueError invalid URL, protocol 'tickrig' not known",
        ),
    ],
)
def test_what_makes_pyserial_know_it(imports: str, told: str) -> None:
    """An offered name is known in any order: `offer` registers."""
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(imports=imports)],
        env={"PYTHONPATH": ":".join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert process.stdout.startswith(told)


def test_importing_tickrig_imports_no_pyserial() -> None:
    program = "import sys, tickrig; print('serial' in sys.modules, len(sys.modules))"
    process = subprocess.run(
        [sys.executable, "-S", "-c", program],
        env={"PYTHONPATH": ":".join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert process.stdout.startswith("False")

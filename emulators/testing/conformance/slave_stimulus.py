"""Moves the inputs of a slave of ours from the inside, in the words of the tester."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.host.canopen.conform.bus.step_failed import NotAllowed
from tickrig.wire.errors import FieldError

LINES: Final = 8
"""`di1` is lines 1 to 8, `di2` those that follow."""

ANALOGUE: Final = 0x6401
INPUTS: Final = {0x6000: "di", ANALOGUE: "ai"}
"""Objects of CiA 401 that show what is at the inputs."""


class SlaveStimulus:
    """The hands at a slave.

    Args:
        slave: the slave; its supply is switched elsewhere.
    """

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave, self._application = slave, Application.of(slave)

    def __call__(self, *words: str) -> str:
        """Do it, and return what was read; NotAllowed if the slave has nothing of the kind."""
        slave, application = self._slave, self._application
        match words:
            case ("input", name, data) if ":" in name:
                self._assign(name, bytes.fromhex(data))
            case ("output", "time"):
                time = slave.time_of_day
                return "none" if time is None else f"{time.ms}.{time.days}"
            case ("emergency", code, register):
                slave.emergency(int(code, 16), int(register, 16))
            case ("emergency-clear", code):
                slave.emergency_clear(int(code, 16))
            case ("node-id", node_id):
                slave.configured_id = int(node_id, 16)
            case ("fault", code) if isinstance(application, Ds402):
                application.fault(int(code, 16))
            case _ if isinstance(application, Ds401):
                return _module(application, words)
            case _:
                raise _unknown(words)
        return ""

    def _assign(self, name: str, data: bytes) -> None:
        """Write an object from the inside; one that shows inputs by moving these."""
        index, sub = (int(part, 16) for part in name.split(":"))
        if isinstance(self._application, Ds401) and index in INPUTS:
            value = int.from_bytes(data, "little", signed=index == ANALOGUE)
            text = f"{value}" if index == ANALOGUE else f"{value:02X}"
            _module(self._application, ("input", f"{INPUTS[index]}{sub}", text))
            return
        entry = self._slave.dictionary.find(index, sub)
        if entry is None:
            raise NotAllowed(f"input {name}: the device has no such object")
        try:
            entry.data_type.decode(data)
            entry.assign(data)
        except (FieldError, SdoAbort) as error:
            raise NotAllowed(f"input {name} {data.hex().upper()}: {error}") from None


def _module(module: Ds401, words: tuple[str, ...]) -> str:
    """Move lines, eight at once and in hex, and channels, in counts, of a CiA 401 module."""
    try:
        match words[0], words[1][:2], int(words[1][2:]), words[2:]:
            case "input", "di", number, (data,):
                for bit in range(LINES):
                    line = LINES * (number - 1) + bit + 1
                    module.inputs.set(f"di{line}", int(data, 16) >> bit & 1)
            case "input", "ai", number, (data,):
                _set_counts(module, number, int(data))
            case "output", "do", number, ():
                return f"{int(module.read('do')) >> LINES * (number - 1) & 0xFF:02X}"
            case "output", "ao", number, ():
                return str(module.read(f"ao{number}"))
            case _:
                raise _unknown(words)
    except (ValueError, KeyError) as error:
        raise NotAllowed(f"{' '.join(words)}: {error}") from None
    return ""


def _set_counts(module: Ds401, number: int, counts: int) -> None:
    """Let an analogue input have what its converter turns into these counts."""
    found = (each.channel for each in module.analogue_inputs if each.number == number)
    channel = next(found, None)
    if channel is None:
        raise ValueError(f"there is no analogue input {number}")
    converter = channel.converter
    value = converter.quantity(counts) if converter else counts
    if converter and converter.counts(value) != counts:
        raise ValueError(f"the converter of {channel.name} has no step of {counts} counts")
    module.inputs.set(channel.name, value)


def _unknown(words: tuple[str, ...]) -> NotAllowed:
    return NotAllowed(f"{' '.join(words)}: the device has nothing of the kind")

"""What the `app` steps of the conformance checks do to a slave from the inside."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.datatypes import TimeOfDay


class SlaveActions:
    """The actions that any slave has; a device profile adds its own."""

    def __init__(self, slave: CanopenSlave) -> None:
        self.slave = slave
        self.verbs: dict[str, Callable[..., None]] = {
            "od": self.write_object,
            "nodeid": self.give_node_id,
            "emcy": self.raise_error,
            "emcy_clear": self.clear_error,
            "expect_time": self.expect_time,
        }

    def act(self, verb: str, *args: str) -> None:
        """Do what a step says."""
        assert verb in self.verbs, f"nothing here does {verb!r} yet"
        self.verbs[verb](*args)

    def write_object(self, index: str, sub: str, data: str) -> None:
        """Write an object from the inside."""
        self.slave.dictionary[int(index, 16), int(sub, 16)].assign(bytes.fromhex(data))

    def give_node_id(self, node_id: str) -> None:
        """Set the node-ID of the switches; it counts from the next power-on."""
        self.slave.configured_id = int(node_id, 16)

    def raise_error(self, code: str, register: str) -> None:
        """Raise an error."""
        self.slave.emergency(int(code, 16), int(register, 16))

    def clear_error(self, code: str) -> None:
        """Clear an error."""
        self.slave.emergency_clear(int(code, 16))

    def expect_time(self, milliseconds: str, days: str) -> None:
        """Compare the latest time stamp."""
        wanted = TimeOfDay(int(milliseconds), int(days))
        assert self.slave.time_of_day == wanted, f"{self.slave.time_of_day}, want {wanted}"


class GenericIoActions(SlaveActions):
    """The physical side of a CiA 401 module: eight lines at once, channels in counts."""

    def __init__(self, slave: CanopenSlave) -> None:
        super().__init__(slave)
        self._module = Ds401.of(slave)
        self.verbs |= {"di": self.set_digital, "ai": self.set_analogue}
        self.verbs |= {"expect_do": self.expect_digital, "expect_ao": self.expect_analogue}

    def set_digital(self, number: str, level: str) -> None:
        """Set eight lines, in hex."""
        for bit in range(8):
            line = 8 * (int(number) - 1) + bit + 1
            self._module.inputs.set(f"di{line}", int(level, 16) >> bit & 1)

    def set_analogue(self, number: str, level: str) -> None:
        """Set a value, in decimal."""
        self._module.inputs.set(f"ai{number}", int(level))

    def expect_digital(self, number: str, level: str) -> None:
        """Compare eight lines, in hex."""
        got = int(self._module.read("do")) >> 8 * (int(number) - 1) & 0xFF
        assert got == int(level, 16), f"outputs are {got:02X}, want {level}"

    def expect_analogue(self, number: str, level: str) -> None:
        """Compare a value, in decimal."""
        got = self._module.read(f"ao{number}")
        assert got == int(level), f"output is {got}, want {level}"


class DriveActions(SlaveActions):
    """The physical side of a CiA 402 drive."""

    def __init__(self, slave: CanopenSlave) -> None:
        super().__init__(slave)
        self._drive = Ds402.of(slave)
        self.verbs |= {"fault": self.have_fault}

    def have_fault(self, code: str) -> None:
        """Have a fault, by its error code."""
        self._drive.fault(int(code, 16))

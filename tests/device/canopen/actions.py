"""What the `app` steps of the conformance checks do to a slave from the inside."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.time_of_day import TimeOfDay


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

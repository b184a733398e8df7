"""Finds faults of a motor core unit, tells them, and lets go of them."""

from __future__ import annotations

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.motor_core_unit.faults import FAULTS, Fault, Signs


class Supervision:
    """The faults that there are: each is told by EMCY, and again when it is cleared.

    Args:
        node: the slave.

    Attributes:
        faults: those that there are, in the order in which they came.
    """

    def __init__(self, node: CanopenSlave) -> None:
        self._node = node
        self.faults: list[Fault] = []
        self._since_us: dict[Fault, int] = {}

    @property
    def waiting(self) -> bool:
        """Whether a cause is seen, but not for long enough yet."""
        return bool(self._since_us)

    def start(self) -> None:
        """Know of no fault; a cause that is still there is found anew."""
        self.faults.clear()
        self._since_us.clear()

    def look(self, now_us: int, signs: Signs) -> bool:
        """Look for causes; say whether there is a new fault."""
        known = len(self.faults)
        for fault in FAULTS:
            if fault in self.faults:
                continue
            if not fault.seen(signs):
                self._since_us.pop(fault, None)
            elif now_us - self._since_us.setdefault(fault, now_us) >= fault.after_us:
                self._raise(fault)
        return len(self.faults) > known

    def clear(self, signs: Signs) -> bool:
        """Let go of the faults whose cause is gone; say whether there were any."""
        gone = [fault for fault in self.faults if fault.gone(signs)]
        for fault in gone:
            self.faults.remove(fault)
            self._node.emergency_clear(fault.code)
        return bool(gone)

    def _raise(self, fault: Fault) -> None:
        del self._since_us[fault]
        self.faults.append(fault)
        self._node.emergency(fault.code, fault.register)

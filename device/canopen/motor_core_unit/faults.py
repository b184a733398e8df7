"""What may go wrong in a motor core unit, how it is seen, and the EMCYs of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.emcy import ErrorRegister


@dataclass(frozen=True, slots=True)
class Measurements(Immutable):
    """What the unit measures of itself.

    Attributes:
        on: the power stage is on.
        loops: a velocity is to be kept.
        tripped: the comparator of the power stage has switched it off.
        supply_mv: supply of the motor.
        winding_dc: temperature of the winding, 0.1 degC.
        housing_dc: temperature of the housing and of the power stage in it, 0.1 degC.
        velocity_deg_s: velocity of the shaft by the motor encoder.
        current_ma: current in the motor.
        limited: limits or the supply keep the current below what the loops want.
        deviates: the motor is far from what is wanted of it.
        spare_mv: voltage that the supply leaves above the back-EMF, to make a current with.
        overloaded: the I2t of the power stage is used up.
        slip_deg: by how much motor encoder and gear encoder disagree.
    """

    on: bool
    loops: bool
    tripped: bool
    supply_mv: int
    winding_dc: int
    housing_dc: int
    velocity_deg_s: float
    current_ma: int
    limited: bool
    deviates: bool
    spare_mv: int
    overloaded: bool
    slip_deg: float


@dataclass(frozen=True, slots=True)
class Fault(Immutable):
    """One row of the table.

    Attributes:
        name: for people.
        code: emergency error code (CiA 402-1).
        register: bits of the error register.
        seen: whether the cause is there.
        gone: whether it is not there any more; not always the opposite of `seen`.
        after_us: for how long it must be seen.
    """

    name: str
    code: int
    register: ErrorRegister
    seen: Callable[[Measurements], bool]
    gone: Callable[[Measurements], bool]
    after_us: int = 0

    def __reduce__(self) -> tuple[Callable[[str], Fault], tuple[str]]:
        """Stand in a pickle by its name."""
        return _fault, (self.name,)


def _fault(name: str) -> Fault:
    return next(fault for fault in FAULTS if fault.name == name)


SUPPLY_MV: Final = (10_000, 66_000)
"""10 V (NEDO report, Table 6), and a tenth above its 60 V."""

SUPPLY_MARGIN_MV: Final = 1_000
WINDING_DC: Final = 1_180
HOUSING_DC: Final = 1_100
COOLED_DC: Final = 100
"""A temperature must fall by so much before a fault can be cleared."""

STALLED_DEG_S: Final = 1.0
STALLED_US: Final = 500_000
OVERLOADED_US: Final = 1_000_000
NO_CURRENT_MA: Final = 50
NO_CURRENT_US: Final = 100_000
SPARE_MV: Final = 500
"""With less no current is missed: the motor turns as fast as its supply lets it."""
SLIP_DEG: Final = 1.0
DIP_US: Final = 5_000

_DRIVE: Final = ErrorRegister.DEVICE_PROFILE


def _unless_tripped(measured: Measurements) -> bool:
    """Take a cause for gone that is not seen without power or motion: it would come back."""
    return not measured.tripped


FAULTS: Final = (
    Fault("short circuit", 0x2320, ErrorRegister.CURRENT, lambda s: s.tripped, _unless_tripped),
    Fault(
        *("under-voltage", 0x3220, ErrorRegister.VOLTAGE),
        seen=lambda s: s.supply_mv < SUPPLY_MV[0],
        gone=lambda s: s.supply_mv >= SUPPLY_MV[0] + SUPPLY_MARGIN_MV,
        after_us=DIP_US,
    ),
    Fault(
        *("over-voltage", 0x3210, ErrorRegister.VOLTAGE),
        seen=lambda s: s.supply_mv > SUPPLY_MV[1],
        gone=lambda s: s.supply_mv <= SUPPLY_MV[1] - SUPPLY_MARGIN_MV,
    ),
    Fault(
        *("over-temperature of the housing", 0x4210, ErrorRegister.TEMPERATURE),
        seen=lambda s: s.housing_dc > HOUSING_DC,
        gone=lambda s: s.housing_dc <= HOUSING_DC - COOLED_DC,
    ),
    Fault(
        *("over-temperature of the motor", 0x4310, ErrorRegister.TEMPERATURE),
        seen=lambda s: s.winding_dc > WINDING_DC,
        gone=lambda s: s.winding_dc <= WINDING_DC - COOLED_DC,
    ),
    Fault(
        *("motor encoder", 0x7305, _DRIVE),
        seen=lambda s: s.slip_deg > SLIP_DEG,
        gone=_unless_tripped,
    ),
    Fault(
        *("motor commutation", 0x7122, _DRIVE),
        seen=lambda s: s.deviates and abs(s.current_ma) < NO_CURRENT_MA and s.spare_mv > SPARE_MV,
        gone=_unless_tripped,
        after_us=NO_CURRENT_US,
    ),
    Fault(
        *("motor blocked", 0x7121, _DRIVE),
        seen=lambda s: s.loops and s.limited and abs(s.velocity_deg_s) < STALLED_DEG_S,
        gone=_unless_tripped,
        after_us=STALLED_US,
    ),
    Fault(
        *("continuous over-current", 0x2310, ErrorRegister.CURRENT),
        seen=lambda s: s.overloaded and s.limited,
        gone=_unless_tripped,
        after_us=OVERLOADED_US,
    ),
)
"""In this order; what is seen first is reported first."""


class Supervision(Part):
    """The faults that there are: each is reported by EMCY, and again when it is cleared.

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

    def look(self, now_us: int, measured: Measurements) -> bool:
        """Look for causes. Returns: whether there is a new fault."""
        known = len(self.faults)
        for fault in FAULTS:
            if fault in self.faults:
                continue
            if not fault.seen(measured):
                self._since_us.pop(fault, None)
            elif now_us - self._since_us.setdefault(fault, now_us) >= fault.after_us:
                self._raise(fault)
        return len(self.faults) > known

    def clear(self, measured: Measurements) -> bool:
        """Let go of the faults whose cause is gone. Returns: whether there were any."""
        gone = [fault for fault in self.faults if fault.gone(measured)]
        for fault in gone:
            self.faults.remove(fault)
            self._node.emergency_clear(fault.code)
        return bool(gone)

    def _raise(self, fault: Fault) -> None:
        del self._since_us[fault]
        self.faults.append(fault)
        self._node.emergency(fault.code, fault.register)

"""What the base says of itself, in words."""

from __future__ import annotations

from tickrig.wire.modbus.requests import ExceptionCode, Request
from tickrig.wire.rh3 import Fault


def fault_text(left: Fault, right: Fault) -> str:
    """Return the faults of both wheels, each with the wheels that have it.

    >>> fault_text(Fault.EMERGENCY_STOP | Fault.STALL, Fault.EMERGENCY_STOP)
    'stall (left), emergency stop (left, right)'
    >>> fault_text(Fault(0x20), Fault(0))
    'fault 20h (left)'
    """
    sides = {"left": left, "right": right}
    bits = [1 << place for place in range((left | right).bit_length())]
    named = {bit: ", ".join(side for side, fault in sides.items() if fault & bit) for bit in bits}
    return ", ".join(f"{_name(bit)} ({who})" for bit, who in named.items() if who) or "unknown"


def _name(bit: int) -> str:
    return _words(Fault(bit).name or f"fault {bit:02X}h")


def refusal_text(request: Request, code: ExceptionCode | int) -> str:
    """Return which request was refused, and why.

    >>> refusal_text(Request(3, (0x10, 1)), ExceptionCode.ILLEGAL_DATA_ADDRESS)
    'function 03h at 0010h: illegal data address'
    """
    first, _ = request.write or request.read or (0, 0)
    why = _words(code.name) if isinstance(code, ExceptionCode) else f"exception code {code:02X}h"
    return f"function {request.function:02X}h at {first:04X}h: {why}"


def _words(name: str) -> str:
    return name.lower().replace("_", " ")

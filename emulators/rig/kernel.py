"""The optional kernel: the fast paths of an intact CAN bus and its stations, in C.

If `_kernel.c` was built, the classes below come from it. They have the fields of `Station`,
`Timetable`, `CanEnd`, `CanArbiter`, `CanRoutes`, `BusyTime` and `CanSegment`. A method marked with
`in_kernel` is replaced by the C function of the same name.

There is only one state, in these fields. The C function calls the Python method for special cases,
also in the middle of a run. Snapshots, forks and pickles contain the same fields with and without
the kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, TypeVar

_F = TypeVar("_F", bound=Callable[..., object])


def _load() -> Any:
    """Return the C module, or None if it was not built."""
    try:
        return import_module("tickrig.emulators.rig._kernel")
    except ModuleNotFoundError:
        return None


_KERNEL: Final = _load()

kernel: bool = _KERNEL is not None
"""Whether this installation has the kernel."""


def in_kernel(method: _F) -> _F:
    """Replace a method by the kernel's function of the same name, if it exists."""
    if _KERNEL is None:
        return method
    replaced: _F = _KERNEL.method(method.__qualname__, method)
    return replaced


def enable(wanted: bool) -> bool:
    """Switch the kernel on or off; return the previous setting."""
    return _KERNEL is not None and bool(_KERNEL.enable(wanted))


def bits(frame: object) -> int | None:
    """Return the length of a CAN frame in bits, as the compiled kernel counts it.

    The result is None if the kernel does not support the frame. The caller then counts the bits
    with Python code.
    """
    counted: int | None = _KERNEL.frame_bits(frame)
    return counted


if TYPE_CHECKING or _KERNEL is None:

    class StationFields:
        """The fields of a `Station`."""

        __slots__ = ("_timetable", "at_us", "device", "port", "tick_us")

    class TimetableFields:
        """The fields of a `Timetable`."""

        __slots__ = ("_stations", "_ticks", "first_us", "in_step", "open_us")

    class EndFields:
        """The fields of a `CanEnd`."""

        __slots__ = (
            *("_accepts", "_behind", "_device", "_error_aware", "_first", "_more"),
            *("_reconfigured_by", "arrived_us", "auto_recovery", "controller", "held", "lost"),
            *("next", "number", "on_error_state", "room", "segment", "unfiltered", "waiting"),
            *("wake", "wire"),
        )

    class ArbiterFields:
        """The fields of a `CanArbiter`."""

        __slots__ = ("_ends", "free", "heads", "slow")

    class RoutesFields:
        """The fields of `CanRoutes`."""

        __slots__ = ("_table", "ends", "unfiltered")

    class BusyFields:
        """The fields of a `BusyTime`."""

        __slots__ = ("_since", "_spans", "_until")

    class SegmentFields:
        """The fields of a `CanSegment`."""

        __slots__ = (
            *("_arbiter", "_confinement", "_due_us", "_faults", "_finish", "_free"),
            *("_news", "_observers", "_on_bus", "_on_traffic", "_recovery", "_repeating"),
            *("_sound", "_stale", "_start", "_announced", "_winners", "bit", "busy", "now_us"),
            *("received", "routes", "shorted", "unit", "whole"),
        )

    def run(rig: object, parts: object, until_us: int, unseen_us: int, host: object, /) -> bool:
        """Run a rig up to a time in the compiled kernel, as `Rig.run_to` does.

        Args:
            rig: the rig.
            parts: the parts of the rig that the kernel uses: timetable, bus, event queue,
                `Horizon`, watchers, hosts, and the devices at their ports (stations).
            until_us: end of the run, in microseconds.
            unseen_us: time in microseconds up to which no code is expected to read a device. Up to
                this time a device may compute several ticks in advance.
            host: end of a wire at which a host waits for traffic, or None if no host waits.

        Returns:
            False if Python must run the rest.
        """
        return False

    def tick_stations(timetable: object, now_us: int, /) -> bool:
        """Run the stations with work; return False if Python must run them."""
        return False

    def enter_stations(timetable: object, stations: object, /) -> bool:
        """Enter stations that became due earlier in the timetable; return False if Python must."""
        return False

else:
    run, tick_stations = _KERNEL.run, _KERNEL.tick_stations
    enter_stations = _KERNEL.enter_stations
    StationFields, TimetableFields = _KERNEL.StationFields, _KERNEL.TimetableFields
    EndFields, ArbiterFields = _KERNEL.EndFields, _KERNEL.ArbiterFields
    RoutesFields, BusyFields = _KERNEL.RoutesFields, _KERNEL.BusyFields
    SegmentFields = _KERNEL.SegmentFields

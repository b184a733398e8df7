"""The optional kernel: the short ways of a sound CAN bus and of its stations, in C.

Where `_kernel.c` was built, the classes below come from there. They hold the fields of `Station`,
`Timetable`, `CanEnd`, `CanArbiter`, `CanRoutes`, `BusyTime` and `CanSegment`, and a method that is
marked with `in_kernel` is replaced by the function in C of the same name. There is one state, in
these fields: the C function calls the Python method for all that is not plain, in the middle of a
run too, and snapshots, forks and pickles see the same fields with and without it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, TypeVar

F = TypeVar("F", bound=Callable[..., object])


def _load() -> Any:
    """Return the module in C, None where it was not built."""
    try:
        return import_module("tickrig.emulators.rig._kernel")
    except ModuleNotFoundError:
        return None


_KERNEL: Final = _load()

kernel: bool = _KERNEL is not None
"""Whether this installation has the kernel."""


def in_kernel(method: F) -> F:
    """Let the kernel's function of the same name take the place of a method, if there is one."""
    if _KERNEL is None:
        return method
    replaced: F = _KERNEL.method(method.__qualname__, method)
    return replaced


def enable(wanted: bool) -> bool:
    """Use the kernel or leave everything to Python, from now on; return what was before."""
    return _KERNEL is not None and bool(_KERNEL.enable(wanted))


def bits(frame: object) -> int | None:
    """Return the bits of a frame as the kernel counts them; None for what it leaves to Python."""
    counted: int | None = _KERNEL.frame_bits(frame)
    return counted


if TYPE_CHECKING or _KERNEL is None:

    class StationFields:
        """The fields of a `Station`."""

        __slots__ = ("_timetable", "at_us", "device", "port", "tick_us")

    class TimetableFields:
        """The fields of a `Timetable`."""

        __slots__ = ("_stations", "_ticks", "first_us", "open_us")

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
            *("_arbiter", "_confinement", "_due_us", "_faults", "_finish", "_free", "_lengths"),
            *("_news", "_observers", "_on_bus", "_on_traffic", "_recovery", "_repeating"),
            *("_sound", "_stale", "_start", "_announced", "_winners", "bit", "busy", "now_us"),
            *("received", "routes", "shorted", "unit", "whole"),
        )

    def run(rig: object, parts: object, until_us: int, unseen_us: int, /) -> bool:
        """Let a rig run up to a time in C, as `Rig.run_to`; False if there is more to be done.

        Args:
            rig: the rig.
            parts: its timetable, bus, event queue, horizon, watchers, hosts and stations.
            until_us: the time.
            unseen_us: up to then nobody looks at a device.
        """
        return False

    def tick_stations(timetable: object, now_us: int, /) -> bool:
        """Let the stations compute and send that have work; False if Python has to."""
        return False

    def enter_stations(timetable: object, stations: object, /) -> bool:
        """Enter the stations that are due earlier than they stand; False if Python has to."""
        return False

else:
    run, tick_stations = _KERNEL.run, _KERNEL.tick_stations
    enter_stations = _KERNEL.enter_stations
    StationFields, TimetableFields = _KERNEL.StationFields, _KERNEL.TimetableFields
    EndFields, ArbiterFields = _KERNEL.EndFields, _KERNEL.ArbiterFields
    RoutesFields, BusyFields = _KERNEL.RoutesFields, _KERNEL.BusyFields
    SegmentFields = _KERNEL.SegmentFields

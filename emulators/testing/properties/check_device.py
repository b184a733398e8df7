"""One call that tests what every device must keep, whoever wrote it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from hypothesis import strategies as st

from tickrig.device.core import Device
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DEVICES, DeviceType
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties import strategies
from tickrig.emulators.testing.properties.acts import check_start
from tickrig.emulators.testing.properties.checks import DeviceChecks
from tickrig.emulators.testing.properties.contract import check_members
from tickrig.emulators.testing.properties.device_bench import NOTHING, DeviceBench
from tickrig.emulators.testing.properties.difference import TicksDifferError, explain_ticks
from tickrig.emulators.testing.properties.search import search
from tickrig.emulators.testing.properties.strategies import Session

WireMaker = Callable[[], ByteLine | CanWire]


def check_device(  # noqa: PLR0913 - by name
    device_type: DeviceType | str | Callable[[], Device[Any]],
    *,
    traffic: st.SearchStrategy[Any] | None = None,
    wire: WireMaker | None = None,
    start: Session = NOTHING,
    max_examples: int = 30,
    remembers: bool = False,
    pauses: bool = True,
) -> None:
    r"""Test a type of device with any session: bytes or frames, inputs, resets, pauses.

    - It has what a device has, and what it returns is of the types that are wanted; `tick` clears
      `inputs.changed`.
    - Nothing that it meets raises.
    - A fresh device that meets the same does the same; on a line from its trace, too.
    - Ticks at which it is not due change nothing (dense = sparse), up to a day later.
    - A host that writes in pieces is answered as one that writes at once. One of the words of
      `strategies.chunks` that comes in two ticks is answered as one that comes in one.
    - A reset device is as one that was made anew, with the same inputs.
    - A copy, by `copy.deepcopy`, by pickle and with its rig, goes on as the original; what is
      done to it leaves the original unchanged. One that is put back by a snapshot goes on as
      it was.

    Args:
        device_type: what makes the device: its `DeviceType` or the name of one, a class or
            function.
        traffic: what a host sends at once, `strategies.chunks(...)` or `strategies.frames(...)`;
            noise unless given.
        wire: makes what the device is on, as `CanWire`; that of its type, or a serial line,
            unless given.
        start: what is done before each session, so that the device is at work, one after the
            other: `(5_000, "send", b"ON\n")` sends after 5 ms, `(0, "set", ("jam", 1))` sets an
            input, `(0, "reset", None)` resets.
        max_examples: how many sessions for each of the tests.
        remembers: a reset leaves more than configuration and inputs: stored parameters, or where
            an axis is.
        pauses: what a host sends means the same with pauses in it; not where a pause ends it, as
            in Modbus RTU.

    Raises:
        AssertionError: one of these does not hold; the text says when and what, a note has the
            shortest session found.
        ValueError: an act of `start` cannot be done, or there is no type of this name.

    >>> check_device("rrc", traffic=strategies.chunks([b"hello\n", b"device\n"]), max_examples=2)
    """
    make, wire = _parts(device_type, wire)
    on_can = isinstance(wire(), CanWire)
    nothing: Any = () if on_can else b""
    device = make()
    check_members(device, nothing)
    check_start(start, device, nothing)
    if traffic is None:
        traffic = strategies.frames() if on_can else strategies.chunks()
    bench = partial(DeviceBench, make=make, wire=wire, start=start)
    find = partial(search, drawn=strategies.sessions(device, traffic), max_examples=max_examples)
    checks = DeviceChecks(bench, remembers, pauses)
    try:
        find(checks.check_ticks, names=("session",))
    except TicksDifferError as error:
        text, session = error.args
        error.args = (explain_ticks(bench, start, session) or text,)
        raise
    find(checks.check_reset, names=("session", "after"))
    find(checks.check_replay, names=("session",))
    find(checks.check_copies, names=("session", "after", "otherwise"))


def _parts(
    device_type: DeviceType | str | Callable[[], Any], wire: WireMaker | None
) -> tuple[Callable[[], Any], WireMaker]:
    """Return what makes the device, and what makes its wire."""
    made = DEVICES.load(device_type) if isinstance(device_type, str) else device_type
    if isinstance(made, DeviceType):
        return partial(made.build, {}), wire or partial(made.line.wire, made.line.baud)
    if not callable(made):
        raise ValueError(f"a device type, its name, a class or a function, got {made!r:.60}")
    return made, wire or SerialLine

"""What a test does to one device of a bench, and where its host connects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, cast

from tickrig.emulators.bench.fault_spec import parse_fault_spec
from tickrig.emulators.testing.bench.bench_rig import BenchDescription
from tickrig.emulators.testing.bench.modes.mode import BenchMode
from tickrig.emulators.testing.bench.triggers import Condition, LineTrigger, check_condition
from tickrig.host.text.values import Setting, us_of

if TYPE_CHECKING:
    import can
    import canopen
    import serial

    from tickrig.host.links.link import Link

Duration = int | str
"""Microseconds, or a text as `"100ms"`."""

PRESS: Final = "100ms"
SOON: Final = "100ms"


class BenchDevice:
    """A device of a bench: hands at it, eyes on it, and the doors for its host.

    Inputs, outputs, buttons and faults have the names that `describe` gives.

    Args:
        mode: of the bench.
        name: of the device; empty for all of them, whose signals are `NAME/signal` then.

    Attributes:
        name: of the device.
    """

    def __init__(self, mode: BenchMode, name: str = "") -> None:
        self._mode, self.name = mode, name

    def describe(self) -> BenchDescription:
        """Return what there is to set, to read and to break; printed, it is a list for people.

        >>> from tickrig import Bench
        >>> with Bench("rrc") as bench:
        ...     about = bench.describe()
        >>> about.inputs["gauge"].unit, about.outputs["state"].text, about.faults["flip"].rated
        ('', 'state of the RRC', True)
        """
        return self._mode.describe(self.name)

    def set(self, name: str, *values: Setting | Sequence[Setting]) -> None:
        """Set an input, or all inputs of a group.

        Args:
            name: of the input or group, as `stick`.
            values: one, or one for each input of the group; a list of them will do.

        Raises:
            ValueError: there is none, or it does not take the values.
            NotOnThisBench: nobody can do that here.
        """
        each = values[0] if len(values) == 1 and isinstance(values[0], list | tuple) else values
        self._mode.request("set", name=self._full(name), value=list(each))

    def get(self, name: str) -> Setting:
        """Return the present value of an input or output.

        Args:
            name: of the input or output, as `state`.

        Raises:
            ValueError: there is none.
        """
        full = self._full(name)
        values = self._mode.request("get", names=[full])["values"]
        assert isinstance(values, dict)
        value: Setting = values[full]
        return value

    def press(self, name: str, for_: Duration = PRESS) -> None:
        """Press a button and let it go after a time, whoever makes time pass meanwhile.

        Args:
            name: of the button.
            for_: how long it stays pressed, from the tick that sees it.
        """
        self._mode.request("press", name=self._full(name), duration_us=us_of(for_))

    def fault(
        self, spec: str, *, when: Condition | None = None, for_: Duration | None = None
    ) -> None:
        """Let a fault come: now, at a time, or as soon as something is so.

        Args:
            spec: as `cut`, `cut@2s-3s`, `flip=0.001`; a fault of the device or of its wire.
            when: waits for this, such as `on_line("OK:output", nth=3)`; no time in `spec` then.
            for_: how long it stays, from the moment at which it begins; for ever unless given.

        Raises:
            ValueError: there is no such fault, or it cannot be like this.
            NotOnThisBench: it cannot be made here.
        """
        wanted = parse_fault_spec(spec, partial(self._mode.check_fault, self.name))
        for_us = None if for_ is None else us_of(for_)
        if when is not None:
            check_condition(when)
            if "@" in spec:
                raise ValueError(f"{spec}: it waits for something, so it has no time; see for_")
        self._mode.fault(self.name, wanted, when, for_us)

    def clear(self, name: str) -> None:
        """Let a fault go, and its future too.

        Args:
            name: of the fault.

        Raises:
            ValueError: there is none.
        """
        self._mode.clear(self.name, name)

    def switch_off(self) -> None:
        """Take the supply of the device away, of all devices if this is the whole bench.

        Raises:
            NotOnThisBench: it has no switch.
        """
        self._mode.switch_power(self.name, on=False)

    def switch_on(self) -> None:
        """Give the device its supply again.

        Raises:
            NotOnThisBench: it has no switch.
        """
        self._mode.switch_power(self.name, on=True)

    def perform(self, text: str, do: Callable[[], object]) -> None:
        """Have something done that is more than one act, such as bringing the device off.

        Args:
            text: what, as `switch VR2 off, unless it is off`; a human is told so.
            do: does it with an emulator; not called where a human does it.

        Raises:
            OperatorRefused: the human did not do it.
            NotOnThisBench: it cannot be done.
        """
        self._mode.perform(self.name, text, do)

    def observe(self, text: str, seen: Condition, within: Duration = SOON) -> bool:
        """Look whether something is seen at the device: in an emulator, or by who sits there.

        Args:
            text: what, as `the motors drive forward at 30 %`; a human is asked whether it is so.
            seen: says it of an emulator; not asked where a human looks.
            within: how long it may take, beside the tolerance of the bench.
        """
        return self._mode.observe(self.name, text, seen, us_of(within))

    def on_line(self, pattern: str, nth: int = 1) -> LineTrigger:
        """Return what is true as soon as a line, or a frame in candump's notation, has passed.

        Args:
            pattern: the whole line without its end, as `OK:output` or `701#05`; `*` stands for
                anything.
            nth: the how manieth from now on, from 1.
        """
        source = self._mode.wire_of(self.name) if self.name else ""
        trigger = LineTrigger(pattern, nth, source)
        self._mode.hear(trigger.hear)
        return trigger

    @property
    def link(self) -> Link[Any]:
        """A new link for a client: bytes on a serial line, frames on a CAN bus."""
        return self._mode.link(self._wire())

    def serial(self, **options: Any) -> serial.Serial:
        """Open the serial line as a pyserial object, for types what `serial_for_url` returns.

        Args:
            options: as `serial.Serial` takes them; `timeout` passes in the time of the bench.
        """
        return cast("serial.Serial", self._mode.serial(self._wire(), options))

    @property
    def url(self) -> str:
        """Where a program opens the serial line by itself, as long as the bench is open.

        It is what `serial.serial_for_url` takes: `tickrig://rrc`, `/dev/pts/7`, `COM3`.
        """
        address = self._mode.address(self._wire())
        if not isinstance(address, str):
            raise ValueError(f"{self._wire()} is a CAN bus, which has no URL: see bus_options")
        return address

    @property
    def bus_options(self) -> dict[str, Any]:
        """With what a program opens the CAN bus by itself: `can.Bus(**bench.bus_options)`."""
        address = self._mode.address(self._wire())
        if isinstance(address, str):
            raise ValueError(f"{self._wire()} is a serial line, which has no bus: see url")
        return dict(address)

    def can_bus(self, **options: Any) -> can.BusABC:
        """Open the CAN bus as a python-can bus.

        Args:
            options: as `can.Bus` takes them.
        """
        return self._mode.can_bus(self._wire(), options)

    def canopen_network(self) -> canopen.Network:
        """Connect the canopen library to the CAN bus, as a master."""
        return self._mode.canopen_network(self._wire())

    def _wire(self) -> str:
        """Return the wire of this device, or the only one there is."""
        if self.name:
            return self._mode.wire_of(self.name)
        if len(self._mode.wires) > 1:
            known = ", ".join(self._mode.devices)
            raise ValueError(f"this bench has several wires: take that of a device; known: {known}")
        return self._mode.wires[0]

    def _full(self, name: str) -> str:
        """Return the full name of a signal; that of a lone device may have the device before it."""
        if len(self._mode.devices) == 1:
            return name.removeprefix(f"{self._mode.devices[0]}/")
        return f"{self.name}/{name}" if self.name else name

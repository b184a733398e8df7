"""A bench in labgrid: a resource for the bench, and a driver for its console and power.

`imports: [tickrig.testing.labgrid]` in the environment file registers both.
"""

from __future__ import annotations

from typing import Any

import attr
from labgrid.driver import Driver
from labgrid.driver.consoleexpectmixin import ConsoleExpectMixin
from labgrid.factory import target_factory
from labgrid.protocol import ConsoleProtocol, PowerProtocol
from labgrid.resource import Resource
from pexpect import TIMEOUT

from tickrig.emulators.testing.bench.bench import Bench, BenchDevice, open_bench

_TEXT = attr.validators.instance_of(str)
_NUMBER = attr.validators.instance_of(float)


@target_factory.reg_resource
@attr.s(eq=False)
class TickrigBench(Resource):
    """labgrid resource for the bench of a rig file.

    Attributes:
        rig: path of the rig file, relative to the environment file.
        mode: `virtual`, `real` or `hardware`.
        device: name of the device whose console and power the driver uses, if the bench has
            several.
    """

    rig: str = attr.ib(validator=_TEXT)
    mode: str = attr.ib(default="virtual", validator=_TEXT)
    device: str = attr.ib(default="", validator=_TEXT)


@target_factory.reg_driver
@attr.s(eq=False)
class TickrigDriver(ConsoleExpectMixin, Driver, ConsoleProtocol, PowerProtocol):
    """labgrid driver for the console and the power of a device on a bench.

    Activating the driver opens the bench with the supply on. Deactivating the driver closes the
    bench.

    Attributes:
        delay: time for which `cycle` leaves the supply off, in seconds of bench time.
        txdelay: pause between chunks that the console sends, in seconds of real time.
        txchunk: number of bytes in each chunk that the console sends.
        bench: the bench, which exists only while the driver is active.
    """

    bindings = {"place": TickrigBench}  # noqa: RUF012 - as all drivers of labgrid

    delay: float = attr.ib(default=2.0, validator=_NUMBER)
    txdelay: float = attr.ib(default=0.0, validator=_NUMBER)
    txchunk: int = attr.ib(default=1, validator=attr.validators.instance_of(int))

    place: Any
    target: Any
    bench: Bench

    def __attrs_post_init__(self) -> None:
        """Prepare the driver for activation."""
        super().__attrs_post_init__()
        self._port: Any = None

    def on_activate(self) -> None:
        """Open the bench."""
        rig, env = self.place.rig, self.target.env
        self.bench = open_bench(
            rig if env is None else env.config.resolve_path(rig), mode=self.place.mode
        )

    def on_deactivate(self) -> None:
        """Close the bench."""
        self.close()
        self.bench.close()

    @property
    def device(self) -> BenchDevice:
        """The device of the resource, or the whole bench."""
        return self.bench[self.place.device] if self.place.device else self.bench

    def open(self) -> None:
        """Open the serial line."""
        if self._port is None:
            self._port = self.device.serial()

    def close(self) -> None:
        """Close the serial line."""
        port, self._port = self._port, None
        if port is not None:
            port.close()

    def _read(self, size: int = 1, timeout: float = 0.0, max_size: int | None = None) -> bytes:
        """Read at least `size` and at most `max_size` bytes, as labgrid's SerialDriver does."""
        self.open()
        self._port.timeout = timeout
        wanted = max(size, self._port.in_waiting)
        read: bytes = self._port.read(min(wanted, max_size) if max_size else wanted)
        if not read:
            raise TIMEOUT(f"nothing came within {timeout:.2f} s")
        return read

    def _write(self, data: bytes) -> int:
        self.open()
        written: int = self._port.write(data)
        return written

    @Driver.check_active
    def on(self) -> None:
        """Switch the supply on."""
        self.device.switch_on()

    @Driver.check_active
    def off(self) -> None:
        """Switch the supply off."""
        self.device.switch_off()

    @Driver.check_active
    def cycle(self) -> None:
        """Switch the supply off, and switch it on again after `delay`."""
        self.off()
        self.bench.run_for(round(self.delay * 1_000_000))
        self.on()

    @Driver.check_active
    def can_bus(self) -> Any:
        """Open the CAN bus as a python-can bus."""
        return self.device.can_bus()

"""What a developer writes: the ports of a DeviceRTC, and what it does in each state."""

from __future__ import annotations

from copy import copy
from enum import IntEnum
from typing import Any, ClassVar, Final

from tickrig.device.canopen.device_rtc.ports import CanopenInPort, CanopenOutPort, CanopenPort
from tickrig.device.declared import declared
from tickrig.device.physical import InputSignal, QuantityBank
from tickrig.device.twin import Copyable
from tickrig.wire.rtc_canopen.port_types import LONG
from tickrig.wire.rtc_canopen.profile import RtcProfile


class CanopenReturnCode(IntEnum):
    """What a callback returns (OMG RTC 1.1, ReturnCode_t)."""

    RTC_OK = 0
    RTC_ERROR = 1
    BAD_PARAMETER = 2
    UNSUPPORTED = 3
    OUT_OF_RESOURCES = 4
    PRECONDITION_NOT_MET = 5


ERROR: Final = CanopenReturnCode.RTC_ERROR
"""What a callback returns that failed."""

Result = CanopenReturnCode | None
"""What a callback returns; nothing means that all went well."""


class CanopenComponent(Copyable):
    """A component on a CANopen device; a subclass says what it is and does.

    Ports are declared as attributes of the class; each component has its own, with
    objects from 2100h on in order of declaration. Callbacks may be left out. One that
    cannot fail is declared `-> None`; one that can returns `ERROR`. Power-on and Reset
    Node make a new component: what a callback keeps in `self` is the device's RAM.

    Attributes:
        type_name: type of the component; see `RtcProfile` for these six.
        version: as 1.0.
        vendor: who made it.
        category: what it is.
        rate_hz: how often `on_execute`, `error_check` and `on_error` run (DECISION K12).
        product_code: 1018h:02, 0 for one that is made of the type name.
        strict_cia301: whether NMT leads out of Error as CiA 301 has it (DECISION K9).
        physical: physical inputs that the device has beside the bus.
        inputs: their values.

    Raises:
        ValueError: a profile or ports that cannot be.

    >>> from tickrig.device.canopen.device_rtc.ports import CanopenInPort, CanopenOutPort
    >>> from tickrig.wire.rtc_canopen.port_types import LONG
    >>> class Doubler(CanopenComponent):
    ...     type_name = "Doubler"
    ...     number = CanopenInPort("number", LONG)
    ...     double = CanopenOutPort("double", LONG)
    ...
    ...     def on_execute(self) -> None:
    ...         self.double.write(2 * self.number.read())
    >>> [f"{port.index:04X}h {port.profile.name}" for port in Doubler.profile().placed()]
    ['2100h number', '2101h double']
    """

    type_name: ClassVar[str] = ""
    version: ClassVar[str] = "1.0"
    vendor: ClassVar[str] = ""
    category: ClassVar[str] = ""
    rate_hz: ClassVar[int] = 100
    product_code: ClassVar[int] = 0
    strict_cia301: ClassVar[bool] = False
    physical: ClassVar[tuple[InputSignal, ...]] = ()

    def __init__(self) -> None:
        self.inputs = QuantityBank(self.physical)
        self.ports: dict[str, CanopenPort[Any]] = {}
        for name, port in declared(type(self), CanopenPort):
            mine = self.ports[port.name] = copy(port)
            setattr(self, name, mine)

    @classmethod
    def profile(cls) -> RtcProfile:
        """Return what the component says of itself; ValueError if that cannot be."""
        try:
            return RtcProfile(
                type_name=cls.type_name,
                version=cls.version,
                vendor=cls.vendor,
                category=cls.category,
                rate_hz=cls.rate_hz,
                product_code=cls.product_code,
                ports=tuple(port.profile for _, port in declared(cls, CanopenPort)),
            )
        except ValueError as error:
            raise ValueError(f"{cls.__name__}: {error}") from None

    def on_initialize(self) -> Result:
        """Begin: Created becomes Inactive; after an error it stays Created."""

    def on_finalize(self) -> Result:
        """End, before Reset Node or when the device is shut down."""

    def on_activated(self) -> Result:
        """Become Active; an error leads to Error."""

    def on_deactivated(self) -> Result:
        """Leave Active; an error leads to Error, unless that is where it goes anyway."""

    def on_execute(self) -> Result:
        """Work, once a period while Active; an error leads to Error."""

    def error_check(self) -> Result:
        """Look after the device, once a period while Inactive; an error leads to Error."""

    def on_aborting(self) -> None:
        """Come from Active to Error."""

    def on_error(self) -> None:
        """Work, once a period while in Error."""

    def on_reset(self) -> Result:
        """Leave Error; after an error it stays there."""


class CanopenEcho(CanopenComponent):
    """One in-port, one out-port, both Long."""

    type_name = "Echo"
    vendor = "tickrig"
    category = "example"
    inlet = CanopenInPort("in", LONG)
    outlet = CanopenOutPort("out", LONG)

    def on_execute(self) -> None:
        """Hand on what is new."""
        if self.inlet.is_new:
            self.outlet.write(self.inlet.read())

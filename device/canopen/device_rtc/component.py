"""What a developer writes: the ports of a DeviceRTC, and what it does in each state."""

from __future__ import annotations

from typing import ClassVar

from tickrig.device.canopen.device_rtc.ports import CanopenInPort, CanopenOutPort, CanopenPort
from tickrig.device.component import DeviceComponent, Result, declared
from tickrig.device.physical import QuantityBank
from tickrig.wire.rtc_canopen.port_types import LONG
from tickrig.wire.rtc_canopen.profile import RtcProfile


class CanopenComponent(DeviceComponent):
    """A component on a CANopen device; a subclass says what it is and does.

    Ports have objects from 2100h on in order of declaration. Reset Node makes a new
    component, as power-on does.

    Attributes:
        type_name: type of the component; see `RtcProfile` for these six.
        version: as 1.0.
        vendor: who made it.
        category: what it is.
        rate_hz: how often `on_execute`, `error_check` and `on_error` run (DECISION K12).
        product_code: 1018h:02, 0 for one that is made of the type name.
        strict_cia301: whether NMT leads out of Error as CiA 301 has it (DECISION K9).

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

    version: ClassVar[str] = "1.0"
    vendor: ClassVar[str] = ""
    category: ClassVar[str] = ""
    rate_hz: ClassVar[int] = 100
    product_code: ClassVar[int] = 0
    strict_cia301: ClassVar[bool] = False

    def __init__(self) -> None:
        self.inputs = QuantityBank(self.physical)
        self.ports = {port.name: port for port in self._own_ports(CanopenPort)}

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

    def error_check(self) -> Result:
        """Look after the device, once a period while Inactive; an error leads to Error."""


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

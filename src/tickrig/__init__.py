"""A rig on your desk for robot electronics you do not have."""

from tickrig._lazy import lazy

__version__ = "0.1.0"

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.device.core import Device as Device
    from tickrig.emulators.can.wire import CanWire as CanWire
    from tickrig.emulators.rig.clock import VirtualClock as VirtualClock
    from tickrig.emulators.rig.rig import Rig as Rig
    from tickrig.emulators.rig.rig import Station as Station
    from tickrig.emulators.rig.sim_link import SimLink as SimLink
    from tickrig.emulators.serial.rs485_line import Rs485Line as Rs485Line
    from tickrig.emulators.serial.serial_line import SerialLine as SerialLine
    from tickrig.host.control.clock import RealClock as RealClock
    from tickrig.wire.can import CanFrame as CanFrame
    from tickrig.wire.instant import NEVER as NEVER
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "CanFrame": "tickrig.wire.can",
            "CanWire": "tickrig.emulators.can.wire",
            "Device": "tickrig.device.core",
            "NEVER": "tickrig.wire.instant",
            "RealClock": "tickrig.host.control.clock",
            "Rig": "tickrig.emulators.rig.rig",
            "Rs485Line": "tickrig.emulators.serial.rs485_line",
            "SerialLine": "tickrig.emulators.serial.serial_line",
            "SimLink": "tickrig.emulators.rig.sim_link",
            "Station": "tickrig.emulators.rig.rig",
            "VirtualClock": "tickrig.emulators.rig.clock",
        },
    )

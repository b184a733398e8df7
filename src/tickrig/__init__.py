"""Deterministic emulators of robot electronics, and tools for CAN, CANopen and serial hosts."""

from tickrig._lazy import lazy, tell_pyserial

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig._compiled import compiled as compiled
    from tickrig._version import __version__ as __version__
    from tickrig.device.core import Device as Device
    from tickrig.device.physical import InputBank as InputBank
    from tickrig.device.physical import InputSignal as InputSignal
    from tickrig.device.physical import OutputSignal as OutputSignal
    from tickrig.device.physical import QuantityBank as QuantityBank
    from tickrig.device.physical import SignalType as SignalType
    from tickrig.device.twin import Copyable as Copyable
    from tickrig.device.twin.snapshot import MachineSnapshot as MachineSnapshot
    from tickrig.emulators.can.wire import CanWire as CanWire
    from tickrig.emulators.canopen.eds import read_eds as read_eds
    from tickrig.emulators.commands.device_type import DeviceType as DeviceType
    from tickrig.emulators.fields import DeviceField as DeviceField
    from tickrig.emulators.record.frames import FrameFormat as FrameFormat
    from tickrig.emulators.record.frames import FrameSplitter as FrameSplitter
    from tickrig.emulators.record.frames import by_delimiter as by_delimiter
    from tickrig.emulators.record.frames import by_gap as by_gap
    from tickrig.emulators.record.frames import by_length as by_length
    from tickrig.emulators.record.frames import by_size as by_size
    from tickrig.emulators.record.replay import BenchRecording as BenchRecording
    from tickrig.emulators.record.replay import read_trace as read_trace
    from tickrig.emulators.rig.clock import VirtualClock as VirtualClock
    from tickrig.emulators.rig.kernel import kernel as kernel
    from tickrig.emulators.rig.rig import Rig as Rig
    from tickrig.emulators.rig.sim_link import SimLink as SimLink
    from tickrig.emulators.rig.station import Station as Station
    from tickrig.emulators.serial.emulator import LineSettings as LineSettings
    from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS as SERIAL_PORTS
    from tickrig.emulators.serial.outside.serial_side import SerialSide as SerialSide
    from tickrig.emulators.serial.outside.sim_serial import SimSerial as SimSerial
    from tickrig.emulators.serial.rs485_line import Rs485Line as Rs485Line
    from tickrig.emulators.serial.serial_line import SerialLine as SerialLine
    from tickrig.emulators.testing.bench.bench import Bench as Bench
    from tickrig.emulators.testing.bench.bench import open_bench as open_bench
    from tickrig.emulators.testing.bench.errors import BenchBlocked as BenchBlocked
    from tickrig.emulators.testing.bench.errors import BenchError as BenchError
    from tickrig.emulators.testing.bench.errors import MachineTooSlow as MachineTooSlow
    from tickrig.emulators.testing.bench.errors import NotOnThisBench as NotOnThisBench
    from tickrig.emulators.testing.bench.errors import OperatorRefused as OperatorRefused
    from tickrig.emulators.testing.bench.errors import PortGone as PortGone
    from tickrig.emulators.testing.host_clock.host_code import HostHangsError as HostHangsError
    from tickrig.emulators.testing.host_clock.host_code import HostTimeError as HostTimeError
    from tickrig.emulators.testing.host_clock.host_code import (
        UnpatchedTimeError as UnpatchedTimeError,
    )
    from tickrig.emulators.testing.rig_file.plan import RigFileError as RigFileError
    from tickrig.host.control.clock import RealClock as RealClock
    from tickrig.wire.can import CanFrame as CanFrame
    from tickrig.wire.instant import NEVER as NEVER
    from tickrig.wire.lines import LineSplitter as LineSplitter
    from tickrig.wire.uart import UartSetting as UartSetting
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig._compiled": ("compiled",),
            "tickrig._version": ("__version__",),
            "tickrig.device.core": ("Device",),
            "tickrig.device.physical": (
                "InputBank",
                "InputSignal",
                "OutputSignal",
                "QuantityBank",
                "SignalType",
            ),
            "tickrig.device.twin": ("Copyable",),
            "tickrig.device.twin.snapshot": ("MachineSnapshot",),
            "tickrig.emulators.can.wire": ("CanWire",),
            "tickrig.emulators.canopen.eds": ("read_eds",),
            "tickrig.emulators.commands.device_type": ("DeviceType",),
            "tickrig.emulators.fields": ("DeviceField",),
            "tickrig.emulators.record.frames": (
                "FrameFormat",
                "FrameSplitter",
                "by_delimiter",
                "by_gap",
                "by_length",
                "by_size",
            ),
            "tickrig.emulators.rig.clock": ("VirtualClock",),
            "tickrig.emulators.rig.kernel": ("kernel",),
            "tickrig.emulators.rig.rig": ("Rig",),
            "tickrig.emulators.rig.station": ("Station",),
            "tickrig.emulators.rig.sim_link": ("SimLink",),
            "tickrig.emulators.serial.emulator": ("LineSettings",),
            "tickrig.emulators.serial.outside.serial_ports": ("SERIAL_PORTS",),
            "tickrig.emulators.serial.outside.serial_side": ("SerialSide",),
            "tickrig.emulators.serial.outside.sim_serial": ("SimSerial",),
            "tickrig.emulators.serial.rs485_line": ("Rs485Line",),
            "tickrig.emulators.serial.serial_line": ("SerialLine",),
            "tickrig.emulators.record.replay": ("BenchRecording", "read_trace"),
            "tickrig.emulators.testing.bench.bench": ("Bench", "open_bench"),
            "tickrig.emulators.testing.bench.errors": (
                "BenchBlocked",
                "BenchError",
                "MachineTooSlow",
                "NotOnThisBench",
                "OperatorRefused",
                "PortGone",
            ),
            "tickrig.emulators.testing.host_clock.host_code": (
                "HostHangsError",
                "HostTimeError",
                "UnpatchedTimeError",
            ),
            "tickrig.emulators.testing.rig_file.plan": ("RigFileError",),
            "tickrig.host.control.clock": ("RealClock",),
            "tickrig.wire.can": ("CanFrame",),
            "tickrig.wire.instant": ("NEVER",),
            "tickrig.wire.lines": ("LineSplitter",),
            "tickrig.wire.uart": ("UartSetting",),
        },
    )

tell_pyserial()

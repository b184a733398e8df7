"""RT components (OMG RTC 1.0, OpenRTM-aist 1.x) in one process with a given time."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.host.rtc.component import ExecutionContext as ExecutionContext
    from tickrig.host.rtc.component import ModuleSpec as ModuleSpec
    from tickrig.host.rtc.component import RtComponent as RtComponent
    from tickrig.host.rtc.ports.data_port import InPort as InPort
    from tickrig.host.rtc.ports.data_port import OutPort as OutPort
    from tickrig.host.rtc.states import ReturnCode as ReturnCode
    from tickrig.host.rtc.system.manager import Manager as Manager
    from tickrig.wire.rtc_types.rtc import Time as Time
    from tickrig.wire.rtc_types.rtc import TimedBoolean as TimedBoolean
    from tickrig.wire.rtc_types.rtc import TimedDouble as TimedDouble
    from tickrig.wire.rtc_types.rtc import TimedDoubleSeq as TimedDoubleSeq
    from tickrig.wire.rtc_types.rtc import TimedFloat as TimedFloat
    from tickrig.wire.rtc_types.rtc import TimedFloatSeq as TimedFloatSeq
    from tickrig.wire.rtc_types.rtc import TimedLong as TimedLong
    from tickrig.wire.rtc_types.rtc import TimedLongSeq as TimedLongSeq
    from tickrig.wire.rtc_types.rtc import TimedOctet as TimedOctet
    from tickrig.wire.rtc_types.rtc import TimedShort as TimedShort
    from tickrig.wire.rtc_types.rtc import TimedShortSeq as TimedShortSeq
    from tickrig.wire.rtc_types.rtc import TimedString as TimedString
    from tickrig.wire.rtc_types.rtc import TimedULong as TimedULong
    from tickrig.wire.rtc_types.rtc import TimedUShort as TimedUShort
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig.host.rtc.component": ("ExecutionContext", "ModuleSpec", "RtComponent"),
            "tickrig.host.rtc.ports.data_port": ("InPort", "OutPort"),
            "tickrig.host.rtc.states": ("ReturnCode",),
            "tickrig.host.rtc.system.manager": ("Manager",),
            "tickrig.wire.rtc_types.rtc": (
                "Time",
                "TimedBoolean",
                "TimedDouble",
                "TimedDoubleSeq",
                "TimedFloat",
                "TimedFloatSeq",
                "TimedLong",
                "TimedLongSeq",
                "TimedOctet",
                "TimedShort",
                "TimedShortSeq",
                "TimedString",
                "TimedULong",
                "TimedUShort",
            ),
        },
    )

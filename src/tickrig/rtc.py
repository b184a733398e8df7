"""RT components after OMG RTC 1.0 and OpenRTM-aist 1.x, in one process, which is given the time."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.host.rtc.component import RtComponent as RtComponent
    from tickrig.host.rtc.ports.data_port import InPort as InPort
    from tickrig.host.rtc.ports.data_port import OutPort as OutPort
    from tickrig.host.rtc.system.manager import Manager as Manager
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "InPort": "tickrig.host.rtc.ports.data_port",
            "Manager": "tickrig.host.rtc.system.manager",
            "OutPort": "tickrig.host.rtc.ports.data_port",
            "RtComponent": "tickrig.host.rtc.component",
        },
    )

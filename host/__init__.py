"""Host-side proxies and monitors: hardware or emulator, they cannot tell."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.host.links.can_link import CanLink as CanLink
    from tickrig.host.links.serial_link import SerialLink as SerialLink
    from tickrig.host.modbus.master import ModbusMaster as ModbusMaster
    from tickrig.host.rrc.client import RrcClient as RrcClient
    from tickrig.host.rtc_lite.proxy import RtcLiteProxy as RtcLiteProxy
    from tickrig.host.urg.client import UrgClient as UrgClient
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "CanLink": "tickrig.host.links.can_link",
            "ModbusMaster": "tickrig.host.modbus.master",
            "RrcClient": "tickrig.host.rrc.client",
            "RtcLiteProxy": "tickrig.host.rtc_lite.proxy",
            "SerialLink": "tickrig.host.links.serial_link",
            "UrgClient": "tickrig.host.urg.client",
        },
    )

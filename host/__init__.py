"""Host-side proxies and monitors, which work in the same way with hardware and emulators."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.host.links.can_link import CanLink as CanLink
    from tickrig.host.links.link import DeviceRefused as DeviceRefused
    from tickrig.host.links.link import LinkClosed as LinkClosed
    from tickrig.host.links.link import LinkError as LinkError
    from tickrig.host.links.link import LinkTimeout as LinkTimeout
    from tickrig.host.links.recording_link import RecordingLink as RecordingLink
    from tickrig.host.links.serial_link import SerialLink as SerialLink
    from tickrig.host.rrc.client import RrcClient as RrcClient
    from tickrig.host.rtc.lite.proxy import RtcLiteProxy as RtcLiteProxy
    from tickrig.host.rtc.motion.modbus_master import ModbusMaster as ModbusMaster
    from tickrig.host.urg import UrgClient as UrgClient
    from tickrig.wire.rrc.replies import RrcEvent as RrcEvent
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig.host.links.can_link": ("CanLink",),
            "tickrig.host.links.link": (
                "DeviceRefused",
                "LinkClosed",
                "LinkError",
                "LinkTimeout",
            ),
            "tickrig.host.links.recording_link": ("RecordingLink",),
            "tickrig.host.links.serial_link": ("SerialLink",),
            "tickrig.host.rtc.motion.modbus_master": ("ModbusMaster",),
            "tickrig.host.rrc.client": ("RrcClient",),
            "tickrig.host.rtc.lite.proxy": ("RtcLiteProxy",),
            "tickrig.host.urg": ("UrgClient",),
            "tickrig.wire.rrc.replies": ("RrcEvent",),
        },
    )

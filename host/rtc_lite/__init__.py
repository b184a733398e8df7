"""RTC-Lite on the host: a proxy component for a device too small for middleware."""

from tickrig.host.rtc_lite.attachment import Attachment, attach
from tickrig.host.rtc_lite.events import EventKind, Listener, ProxyEvent
from tickrig.host.rtc_lite.proxy import RtcLiteProxy
from tickrig.host.rtc_lite.settings import Settings

__all__ = [
    "Attachment",
    "EventKind",
    "Listener",
    "ProxyEvent",
    "RtcLiteProxy",
    "Settings",
    "attach",
]

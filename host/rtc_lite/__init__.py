"""RTC-Lite on the host: a proxy component for a device too small for middleware."""

from tickrig.host.rtc_lite.attachment import Attachment, attach
from tickrig.host.rtc_lite.events import ProxyEvent, ProxyEventType, ProxyListener
from tickrig.host.rtc_lite.proxy import RtcLiteProxy
from tickrig.host.rtc_lite.settings import ProxySettings

__all__ = [
    "Attachment",
    "ProxyEvent",
    "ProxyEventType",
    "ProxyListener",
    "ProxySettings",
    "RtcLiteProxy",
    "attach",
]

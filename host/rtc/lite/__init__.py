"""RTC-Lite on the host: a proxy component for a device too small for middleware."""

from tickrig.host.rtc.lite.attachment import Attachment, attach
from tickrig.host.rtc.lite.events import ProxyEvent, ProxyEventType, ProxyListener
from tickrig.host.rtc.lite.proxy import RtcLiteProxy
from tickrig.host.rtc.lite.request_channel import ProxySettings

__all__ = [
    "Attachment",
    "ProxyEvent",
    "ProxyEventType",
    "ProxyListener",
    "ProxySettings",
    "RtcLiteProxy",
    "attach",
]

"""A device in a system: its proxy while the device is present, or else a search for the device."""

from __future__ import annotations

import re
from contextlib import ExitStack, closing
from dataclasses import dataclass, field, replace
from typing import Final

from tickrig.host.cli.messages import Refused, refused_at, say
from tickrig.host.links.link import Link, LinkClosed, ReopeningLink
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.component import ExecutionContext
from tickrig.host.rtc.lite.events import ProxyEvent, ProxyEventType, ProxyListener, notify
from tickrig.host.rtc.lite.proxy import RtcLiteProxy
from tickrig.host.rtc.lite.request_channel import POLL_US, ProxySettings, RequestChannel
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.text.log import log_of
from tickrig.host.text.names import near
from tickrig.host.text.values import parse_time_us
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import Framing


class _DeviceWatcher:
    """A watcher that requests the state of a device every 100 ticks, without waiting for answers.

    Args:
        link: line to the device.
        settings: settings with the interval of the requests, and the time limit for an answer.
    """

    def __init__(self, link: Link[bytes], settings: ProxySettings) -> None:
        self._channel, self._settings = RequestChannel(link, settings), settings
        self._next_us = link.now_us + settings.search_period_us
        self._answer_us = link.now_us  # until then an answer may come

    @property
    def due_us(self) -> int:
        """Time at which `tick` has work to do, on the clock of the link."""
        now_us = self._channel.now_us
        return min(self._next_us, now_us + POLL_US) if now_us < self._answer_us else self._next_us

    def tick(self) -> bool:
        """Request the state of the device if that is due.

        Return whether the device has answered.
        """
        self._channel.poll()
        if self._channel.state is None and self._channel.now_us >= self._next_us:
            self._channel.send(LiteCommand.STATE)
            self._answer_us = self._next_us + self._settings.reply_us
            self._next_us += self._settings.search_period_us
        return self._channel.state is not None


_RATE_HZ: Final = 10.0
"""Rate whose period two round trips at 57600 bit/s do not fill."""

_LOG: Final = log_of(__name__)


@dataclass(slots=True)
class Attachment:
    """The supervision of a proxy and its device.

    The attachment sends PINGs, removes the proxy of a lost device, and searches for the device if
    the settings demand this. The manager ticks the attachment. The attachment ends if other code
    deletes its proxy.

    Attributes:
        manager: manager of the system.
        link: line to the device, which stays open.
        base_name: name of the proxy without its number.
        settings: settings with time limits, and whether to search for the device.
        listener: function that is called with events.
        context: execution context of the proxy, or None for a context of its own.
        rate_hz: rate of the proxy's own context.
        proxy: latest proxy of the device.

    Raises:
        RtcRefused: the device does not start up.
        ValueError: an execution context cannot have this rate.
    """

    manager: Manager
    link: Link[bytes]
    base_name: str
    settings: ProxySettings
    listener: ProxyListener | None = None
    context: ExecutionContext | None = None
    rate_hz: float = _RATE_HZ
    proxy: RtcLiteProxy = field(init=False)
    _watcher: _DeviceWatcher | None = field(default=None, init=False)  # for a device that is away

    def __post_init__(self) -> None:
        """Make the first proxy, and make the manager tick this attachment."""
        self.proxy = self._add_proxy()
        self.manager.add_item(self)

    @property
    def due_us(self) -> int:
        """Time in us at which `tick` has work to do, on the clock of the manager.

        The clock of the device's link may differ from it.
        """
        return self.manager.now_us + max(0, self._link_due_us - self.link.now_us)

    def tick(self, now_us: int) -> None:
        """Check the proxy, or search for the device."""
        if self._watcher is not None:
            if self._watcher.tick():
                self.manager.defer(self._return)
        else:
            self._attend(self.proxy)

    @property
    def _link_due_us(self) -> int:
        if self._watcher is not None:
            return self._watcher.due_us
        fatal_us = self.proxy.fatal_us
        return self.proxy.due_us if fatal_us is None else fatal_us + self.settings.linger_us

    def _add_proxy(self) -> RtcLiteProxy:
        name = self.manager.free_name(self.base_name)
        proxy = RtcLiteProxy(name, self.link, self.settings, self.listener)
        return self.manager.add(proxy, self.rate_hz, self.context)

    def _attend(self, proxy: RtcLiteProxy) -> None:
        if not proxy.alive:
            self.manager.remove_item(self)
            return
        proxy.tick()
        if proxy.fatal_us is not None and self.link.now_us >= self._link_due_us:
            self.manager.defer(lambda: self._remove(proxy))

    def _remove(self, proxy: RtcLiteProxy) -> None:
        """Remove a proxy from the system (DECISION L15), unless it was just removed."""
        if not proxy.alive:
            return
        self.manager.delete(proxy.instance_name)
        self._notify(ProxyEventType.REMOVED, proxy)
        if self.settings.rediscover:
            self._watcher = _DeviceWatcher(self.link, self.settings)
        else:
            self.manager.remove_item(self)

    def _return(self) -> None:
        """Make a new proxy for a device that has answered, so that no waiting is necessary."""
        self.settings = replace(self.settings, boot_us=0)
        try:
            self.proxy, self._watcher = self._add_proxy(), None
        except RtcRefused as error:
            _LOG.info("%s answers, but: %s", self.base_name, error)
            self._watcher = _DeviceWatcher(self.link, self.settings)
        else:
            self._notify(ProxyEventType.REDISCOVERED, self.proxy)

    def _notify(self, kind: ProxyEventType, proxy: RtcLiteProxy) -> None:
        pings = proxy.pings if kind is ProxyEventType.REMOVED else None
        event = ProxyEvent(self.link.now_us, kind, proxy.instance_name, pings=pings)
        notify(self.listener, event)


def attach(  # noqa: PLR0913 - options, by keyword
    manager: Manager,
    link: Link[bytes],
    base_name: str,
    settings: ProxySettings | None = None,
    *,
    listener: ProxyListener | None = None,
    context: ExecutionContext | None = None,
    rate_hz: float = _RATE_HZ,
) -> RtcLiteProxy:
    """Add an RTC-Lite device to a system, by a proxy: a component that represents the device.

    The name of the proxy ends with the lowest free number, such as `LiteA0`. The manager sends the
    PINGs, removes the proxy of a lost device, and finds the device again.

    Args:
        manager: manager of the system.
        link: line to the device.
        base_name: name of the proxy without its number.
        settings: settings with time limits, checksum and rediscovery.
        listener: function that is called with the events of the proxy.
        context: execution context of the proxy. By default, the proxy gets its own.
        rate_hz: rate of the proxy's own execution context.

    Raises:
        RtcRefused: the device does not start up.
        ValueError: no execution context can have this rate.
    """
    attachment = Attachment(
        manager, link, base_name, settings or ProxySettings(), listener, context, rate_hz
    )
    return attachment.proxy


# `--lite NAME=URL[@BAUD][,rtno][,boot=TIME]`: how the command line of `tickrig rtc` names devices.
# An Arduino with RTno resets when its port is opened, so RTno has a pause after opening by default.

_BAUD: Final = 57_600
_RTNO_BOOT_US: Final = 3_000_000

_FORM: Final = "NAME=URL[@BAUD][,rtno][,boot=TIME]"
_WORD: Final = re.compile(r"([A-Za-z]\w*)=([^,]+?)(?:@(\d{1,8}))?((?:,[^,]*)*)", re.ASCII)


def attach_lite(
    manager: Manager, word: str, stack: ExitStack, boot_us: int, rate_hz: float | None
) -> None:
    """Add the RTC-Lite device of an option `--lite` to a system: open its line and add its proxy.

    The proxy is a component that represents the device. If the device disappears and comes back,
    the proxy is removed and added again.

    Args:
        manager: manager of the system.
        word: value of the option, `NAME=URL[@BAUD][,rtno][,boot=TIME]`. With `rtno`, the device is
            a board with RTno. The proxy is named `NAME0`.
        stack: exit stack that closes the line.
        boot_us: pause in us after the line is opened, unless the word has `boot`.
        rate_hz: rate of the proxy in Hz, or None for 10 Hz.

    Raises:
        Refused: the word is invalid, the line cannot be opened, or no device answers.
    """
    name, url, baud, settings = _parse_lite(word, boot_us)
    try:
        link = stack.enter_context(closing(ReopeningLink(lambda: SerialLink(url, baud))))
        attach(manager, link, name, settings, listener=_report, rate_hz=rate_hz or _RATE_HZ)
    except (LinkClosed, ValueError) as error:
        raise Refused(f"--lite {word}: {error}") from None


def _parse_lite(word: str, boot_us: int = 0) -> tuple[str, str, int, ProxySettings]:
    """Read name, URL, bit rate and settings. Raise Refused if the word has another form.

    >>> _parse_lite("LiteA=/dev/ttyUSB0")[:3], _parse_lite("B=socket://localhost:7000@9600")[:3]
    (('LiteA', '/dev/ttyUSB0', 57600), ('B', 'socket://localhost:7000', 9600))
    >>> _parse_lite("A=/dev/ttyACM0,rtno")[3].boot_us, _parse_lite("A=x,boot=200ms")[3].boot_us
    (3000000, 200000)
    """
    match = _WORD.fullmatch(word)
    if match is None:
        raise Refused(f"--lite {word!r} is not {_FORM}, as LiteA=/dev/ttyUSB0@57600")
    framing, own_boot_us = Framing.LITE, None
    for option in match[4].split(",")[1:]:
        key, equals, value = option.partition("=")
        if option == "rtno":
            framing = Framing.RTNO
        elif key == "boot" and equals:
            with refused_at(f"--lite {word}"):
                own_boot_us = parse_time_us(value)
        else:
            raise Refused(
                f"--lite {word}: no option {option!r}; {near(key, ('rtno', 'boot=TIME'))}"
            )
    if own_boot_us is None:
        own_boot_us = boot_us or (_RTNO_BOOT_US if framing is Framing.RTNO else 0)
    settings = ProxySettings(framing=framing, boot_us=own_boot_us, rediscover=True)
    return match[1], match[2], int(match[3] or _BAUD), settings


def _report(event: ProxyEvent) -> None:
    say(str(event))

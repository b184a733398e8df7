"""A device's place in a system: its proxy while it is there, a look-out while it is not."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from typing import Final

from tickrig.host.link import NEVER, Link
from tickrig.host.rtc.errors import RtcRefused
from tickrig.host.rtc.execution_context import ExecutionContext
from tickrig.host.rtc.manager import Manager
from tickrig.host.rtc_lite.conversation import POLL_US, Conversation
from tickrig.host.rtc_lite.events import EventKind, Listener, ProxyEvent, tell
from tickrig.host.rtc_lite.proxy import RtcLiteProxy
from tickrig.host.rtc_lite.settings import Settings
from tickrig.wire.rtc_lite.codes import Command

RATE_HZ: Final = 10.0
"""A period that two round trips at 57600 bit/s do not fill."""

_LOG: Final = logging.getLogger(__name__)


@dataclass(slots=True)
class Attachment:
    """Sends the PINGs of a proxy, removes it when its device is lost, and looks for the device.

    The manager ticks it. A proxy that somebody else deletes ends it.

    Attributes:
        manager: of the system.
        link: the line to the device; it stays open.
        base_name: of the proxy, without its number.
        settings: waits, and whether the device is looked for.
        listener: told of events.
        context: execution context of the proxy; None for one of its own.
        rate_hz: of its own one.
        proxy: None while the device is away.
    """

    manager: Manager
    link: Link[bytes]
    base_name: str
    settings: Settings
    listener: Listener | None = None
    context: ExecutionContext | None = None
    rate_hz: float = RATE_HZ
    proxy: RtcLiteProxy | None = field(default=None, init=False)
    _talk: Conversation | None = field(default=None, init=False)  # with a device that is away
    _look_us: int = field(default=NEVER, init=False)

    @property
    def due_us(self) -> int:
        """When `tick` has something to do, as the manager counts time; its clock may be another."""
        link_due_us = self._link_due_us
        if link_due_us == NEVER:
            return NEVER
        return self.manager.now_us + max(0, link_due_us - self.link.now_us)

    def begin(self) -> RtcLiteProxy:
        """Make a proxy and add it; RtcRefused if its device does not start up."""
        name = self.manager.free_name(self.base_name)
        proxy = RtcLiteProxy(name, self.link, self.settings, self.listener)
        self.manager.add(proxy, self.rate_hz, self.context)
        self.proxy, self._talk = proxy, None
        return proxy

    def tick(self, now_us: int) -> None:
        """Mind the proxy, or look for the device."""
        if self.proxy is not None:
            self._mind(self.proxy)
        elif self._talk is not None:
            self._look(self._talk)

    @property
    def _link_due_us(self) -> int:
        proxy, talk = self.proxy, self._talk
        if proxy is not None:
            fatal_us = proxy.fatal_us
            return proxy.due_us if fatal_us is None else fatal_us + self.settings.linger_us
        if talk is None:
            return NEVER
        looked_us = self._look_us - self.settings.look_period_us
        waits = self.link.now_us < looked_us + self.settings.reply_us
        return min(self._look_us, self.link.now_us + POLL_US) if waits else self._look_us

    def _mind(self, proxy: RtcLiteProxy) -> None:
        if not proxy.alive:
            self.proxy = None
            self.manager.drop_item(self)
            return
        proxy.tick()
        if proxy.fatal_us is not None and self.link.now_us >= self._link_due_us:
            self.manager.put_off(lambda: self._remove(proxy))

    def _remove(self, proxy: RtcLiteProxy) -> None:
        """Take a proxy out of the system (DECISION L15)."""
        if proxy.alive:
            self.manager.delete(proxy.instance_name)
        self.proxy = None
        self._tell(EventKind.REMOVED, proxy)
        if self.settings.rediscover:
            self._talk = Conversation(self.link, self.settings)
            self._look_us = self.link.now_us
        else:
            self.manager.drop_item(self)

    def _look(self, talk: Conversation) -> None:
        talk.poll()
        if talk.state is not None:
            self.manager.put_off(self._return)
        elif self.link.now_us >= self._look_us:
            talk.post(Command.STATE)
            self._look_us += self.settings.look_period_us

    def _return(self) -> None:
        """Make a new proxy for a device that has answered, and so need not be waited for."""
        self.settings = replace(self.settings, boot_us=0)
        try:
            self._tell(EventKind.REDISCOVERED, self.begin())
        except RtcRefused as error:
            _LOG.info("%s answers, but: %s", self.base_name, error)
            self._talk = Conversation(self.link, self.settings)

    def _tell(self, kind: EventKind, proxy: RtcLiteProxy) -> None:
        tell(self.listener, ProxyEvent(self.link.now_us, kind, proxy.instance_name))


def attach(  # noqa: PLR0913 - options, by keyword
    manager: Manager,
    link: Link[bytes],
    base_name: str,
    settings: Settings | None = None,
    *,
    listener: Listener | None = None,
    context: ExecutionContext | None = None,
    rate_hz: float = RATE_HZ,
) -> RtcLiteProxy:
    """Add a proxy to a system, named with the lowest number that is free: `LiteA0`.

    Args:
        manager: of the system; it sends the PINGs, removes the proxy and finds the device again.
        link: the line to the device.
        base_name: of the proxy, without its number.
        settings: waits, checksum, rediscovery.
        listener: told of events.
        context: an execution context to take part in, in place of an own one.
        rate_hz: of its own one.

    Raises:
        RtcRefused: the device does not start up.
        ValueError: a rate that no execution context can have.
    """
    place = Attachment(manager, link, base_name, settings or Settings(), listener, context, rate_hz)
    proxy = place.begin()
    manager.run_item(place)
    return proxy

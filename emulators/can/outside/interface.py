"""The python-can interface `tickrig`: rigs in virtual time by channel name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Final

import can
from can.broadcastmanager import CyclicSendTaskABC, ModifiableCyclicTaskABC
from can.typechecking import CanFilters, Channel

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import OneThread
from tickrig.host.links.can_link import to_frame, to_message
from tickrig.host.links.link import LinkError
from tickrig.host.text.names import near
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.errors import FieldError


class _CanChannels:
    """The buses that can presently be opened by name.

    python-can opens a bus by two strings, so the names must be global to the process. They are
    kept in `CHANNELS`, the only global state of this package. `offer` adds a name for the duration
    of a `with` block and removes it at the end.

    >>> with CHANNELS.offer("robot", Rig(), CanWire()):
    ...     CHANNELS.names
    ('robot',)
    >>> CHANNELS.names
    ()
    """

    def __init__(self) -> None:
        self._channels: dict[str, tuple[Rig, CanWire, OneThread]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The offered names."""
        return tuple(self._channels)

    @contextmanager
    def offer(self, name: str, rig: Rig, wire: CanWire) -> Iterator[None]:
        """Context manager during which python-can can open a bus of a rig by a channel name.

        Args:
            name: name of the channel.
            rig: rig with the bus.
            wire: the bus.

        Raises:
            ValueError: the name is already offered.
        """
        if name in self._channels:
            raise ValueError(f"channel {name!r} is offered already")
        self._channels[name] = (rig, wire, OneThread())
        try:
            yield
        finally:
            del self._channels[name]

    def open(self, name: str, *, hears_own: bool = False) -> CanHost:
        """Connect a new host to the bus that is offered under a name.

        Args:
            name: name of the bus.
            hears_own: whether the host also receives its own frames.

        Raises:
            KeyError: no bus is offered under this name.
        """
        rig, wire, thread = self._channels[name]
        return CanHost(rig, wire.end(), thread, hears_own=hears_own)


CHANNELS: Final = _CanChannels()
"""The channels of the interface `tickrig`."""


class TickrigBus(can.BusABC):
    """A host on a rig: `can.Bus(interface="tickrig", channel="name")`.

    `recv` advances the virtual time until a message arrives, or by exactly its timeout. `send`
    takes no time. Timestamps are the rig's time in seconds. Periodic messages are sent while time
    passes.

    Only the thread that opened the rig may use the bus. A `can.Notifier` is refused, because it
    would advance the time itself. A host that needs a `can.Notifier` can use `SimNetwork`, poll,
    or run in real time.

    Args:
        channel: name that `CHANNELS` offers.
        can_filters: filters, as for any bus of python-can.
        receive_own_messages: whether the host also receives its own messages, with `is_rx` False,
            after they have been on the bus.
        listen_only: flag that must be False.
        options: options of other interfaces (bitrate, ...), which are ignored.

    Raises:
        can.CanInitializationError: no rig has this name, or `listen_only` is set.
    """

    def __init__(
        self,
        channel: Channel,
        can_filters: CanFilters | None = None,
        receive_own_messages: bool = False,
        listen_only: bool = False,
        **options: object,
    ) -> None:
        if listen_only:
            raise can.CanInitializationError("tickrig: listen_only is not emulated; leave it out")
        try:
            self._host: CanHost = CHANNELS.open(str(channel), hears_own=receive_own_messages)
        except KeyError:
            hint = near(str(channel), CHANNELS.names)
            raise can.CanInitializationError(f"no rig offers channel {channel!r}; {hint}") from None
        self._channel = str(channel)  # in messages: without a blank, as log formats need it
        self.channel_info = f"tickrig {channel}"
        super().__init__(channel, can_filters)

    @property
    def now_us(self) -> int:
        """The rig's time."""
        return self._host.now_us

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Wait until a message has arrived; return None after `timeout` seconds."""
        begun_us, more = self.now_us, False
        deadline_us = None if timeout is None else begun_us + round(timeout * 1e6)
        while True:
            left_us = None if deadline_us is None else deadline_us - self.now_us
            try:
                taken = self._host.take(left_us, more=more)
            except LinkError as error:
                raise can.CanOperationError(str(error)) from error
            if taken is None:
                return None
            message = to_message(taken[1], taken[0])
            message.channel, message.is_rx = self._channel, not self._host.is_own(taken[0])
            if self._matches_filters(message):
                return message
            more = deadline_us is not None and self.now_us > begun_us

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queue a message; no time passes."""
        try:
            self._host.send((_frame_of(msg),))
        except LinkError as error:
            raise can.CanOperationError(str(error)) from error

    def shutdown(self) -> None:
        """Leave the bus; the rig is unchanged."""
        super().shutdown()
        self._host.close()

    def _send_periodic_internal(
        self,
        msgs: Sequence[can.Message] | can.Message,
        period: float,
        duration: float | None = None,
        autostart: bool = True,
        modifier_callback: Callable[[can.Message], None] | None = None,
    ) -> CyclicSendTaskABC:
        """Send in virtual time."""
        if duration is not None or modifier_callback is not None or not autostart:
            raise NotImplementedError("periodic messages: no duration, modifier or late start")
        return _Periodic(self._host, msgs, period)


class _Periodic(ModifiableCyclicTaskABC):
    """Messages that are sent in turn, one message per period of the rig's time."""

    def __init__(
        self, host: CanHost, messages: Sequence[can.Message] | can.Message, period_s: float
    ) -> None:
        super().__init__(messages, period_s)
        self._repeat = host.repeat(self._frames(), round(period_s * 1e6))

    def stop(self) -> None:
        """Stop sending."""
        self._repeat.stop()

    def modify_data(self, messages: Sequence[can.Message] | can.Message) -> None:
        """Send other data from the next period on."""
        super().modify_data(messages)
        self._repeat.frames = self._frames()

    def _frames(self) -> Frames:
        return tuple(_frame_of(message) for message in self.messages)


def _frame_of(message: can.Message) -> CanFrame:
    """Return the frame of a message; raise CanOperationError if the bus cannot send it."""
    frame = to_frame(message)
    if frame is None:
        raise can.CanOperationError("error frames and CAN FD are not emulated")
    try:
        return frame.checked()
    except FieldError as error:
        raise can.CanOperationError(str(error)) from error

"""Asks a device that is away whether it is back."""

from __future__ import annotations

from tickrig.host.links.link import Link
from tickrig.host.rtc_lite.conversation import POLL_US, Conversation
from tickrig.host.rtc_lite.settings import Settings
from tickrig.wire.rtc_lite.codes import Command


class Lookout:
    """Asks for the state of a device each 100 ticks from now on, and waits for nothing.

    Args:
        link: the line to the device.
        settings: how often, and how long an answer may take.
    """

    def __init__(self, link: Link[bytes], settings: Settings) -> None:
        self._talk, self._settings = Conversation(link, settings), settings
        self._ask_us = link.now_us + settings.look_period_us
        self._answer_us = link.now_us  # until then an answer may come

    @property
    def due_us(self) -> int:
        """When `tick` has something to do, on the clock of the link."""
        now_us = self._talk.now_us
        return min(self._ask_us, now_us + POLL_US) if now_us < self._answer_us else self._ask_us

    def tick(self) -> bool:
        """Ask, if it is time to; return whether the device has answered."""
        self._talk.poll()
        if self._talk.state is None and self._talk.now_us >= self._ask_us:
            self._talk.post(Command.STATE)
            self._answer_us = self._ask_us + self._settings.reply_us
            self._ask_us += self._settings.look_period_us
        return self._talk.state is not None

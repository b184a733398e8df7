"""What differs from one proxy to another, and what the paper leaves open."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.rtc_lite.frame import Checksum, Framing


@dataclass(frozen=True, slots=True)
class ProxySettings:
    """How a proxy talks to its device, and what becomes of it when the device is lost.

    Attributes:
        framing: frames of RTC-Lite, or packets of RTno (bridge mode).
        checksum: how frames are summed up (DECISION L5); packets of RTno always by `sum8`.
        boot_us: silence after the link was opened; 3 s for boards that an open port resets.
        reply_us: how long a reply may take, 1 us or more (DECISION L13).
        ping_period_us: from one PING to the next, whatever else is on the line, 1 us or more
            (DECISION L14).
        pings: how many are unanswered when a device is lost, 1 or more.
        linger_us: how long a proxy stays in Error after that (DECISION L15).
        rediscover: whether the device is looked for afterwards.
        search_period_us: how often, 1 us or more.

    Raises:
        ValueError: a number that is too small, or another sum for packets of RTno.
    """

    framing: Framing = Framing.LITE
    checksum: Checksum = Checksum.SUM8
    boot_us: int = 0
    reply_us: int = 100_000
    ping_period_us: int = 1_000_000
    pings: int = 4
    linger_us: int = 1_000_000
    rediscover: bool = False
    search_period_us: int = 1_000_000

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        if self.framing is Framing.RTNO and self.checksum is not Checksum.SUM8:
            raise ValueError(f"checksum is {self.checksum}, packets of RTno have sum8")
        at_least = {"boot_us": 0, "linger_us": 0}
        for name in (
            "boot_us",
            "reply_us",
            "ping_period_us",
            "pings",
            "linger_us",
            "search_period_us",
        ):
            value, low = getattr(self, name), at_least.get(name, 1)
            if value < low:
                raise ValueError(f"{name} is {value}, at least {low} is needed")

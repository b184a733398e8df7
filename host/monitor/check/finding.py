"""One place where traffic breaks a rule."""

from __future__ import annotations

from typing import NamedTuple

from tickrig.host.monitor.frames.heard import Heard


class Finding(NamedTuple):
    """What is wrong, where and when.

    Attributes:
        at_us: when it was seen.
        rule: name of the rule.
        text: what is wrong, in words.
        heard: the frame that shows it, None if none does.
    """

    at_us: int
    rule: str
    text: str
    heard: Heard | None = None

    def __str__(self) -> str:
        """Write it as one line, time and frame as candump does.

        >>> str(Finding(1_500_000, "nodes", "node 3 was never heard"))
        '(1.500000) nodes: node 3 was never heard'
        """
        shown = f" [{self.heard.channel} {self.heard.frame}]" if self.heard else ""
        seconds, micros = divmod(self.at_us, 1_000_000)
        return f"({seconds}.{micros:06d}) {self.rule}: {self.text}{shown}"

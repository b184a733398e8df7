"""What a log says between its frames: what is missing there, and why it was recorded.

>>> dropped(1_500_000, 12).json()
'{"v":1,"ev":"drop","t":1.5,"n":12,"text":"12 frames were lost"}'
>>> gone(0, "can0", "can0: Network is down").text
'can0 is gone: Network is down'
>>> back(3_250_000, "can0", 3_250_000).text
'can0 is back after 3.250000 s'
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

DROP: Final = "drop"
GONE: Final = "gone"
BACK: Final = "back"
TRIGGER: Final = "trigger"
VERSION: Final = 1
DROP_COUNT: Final = "DROPCOUNT:"

_SAID: Final = re.compile(
    r"(?P<lost>[0-9]{1,15}) frames were lost|trigger: (?P<trigger>.{1,400})"
    r"|(?P<gone>\S{1,32}) is gone: (?P<why>.{1,400})"
    r"|(?P<back>\S{1,32}) is back after (?P<s>[0-9]{1,12})\.(?P<us>[0-9]{6}) s"
    rf"|{DROP_COUNT} dropped (?P<dropped>[0-9]{{1,15}}) CAN frames? on .{{1,100}}"
)
"""What the functions below write, and candump of what its socket dropped; other comments are no
marks."""


class Mark(NamedTuple):
    """Something else than a frame, at its place among the frames.

    Attributes:
        at_us: when; by the clock of this machine, where no frame tells it.
        event: its kind, one of those above.
        text: one line for people, in ASCII.
        channel: the bus it is about; empty for all.
        frames: how many were lost.
        away_us: for how long the bus was away.
    """

    at_us: int
    event: str
    text: str
    channel: str = ""
    frames: int = 0
    away_us: int = 0

    def json(self) -> str:
        """Write it as an object; members that say nothing are left out."""
        import json  # noqa: PLC0415 - seldom wanted

        said: dict[str, object] = {"v": VERSION, "ev": self.event, "t": self.at_us / 1e6}
        said |= {"ch": self.channel} if self.channel else {}
        said |= {"n": self.frames} if self.frames else {}
        said |= {"away": self.away_us / 1e6} if self.away_us else {}
        return json.dumps(said | {"text": self.text}, separators=(",", ":"))


def dropped(at_us: int, frames: int) -> Mark:
    """Say that frames were lost here."""
    return Mark(at_us, DROP, f"{frames} frames were lost", frames=frames)


def gone(at_us: int, channel: str, why: str) -> Mark:
    """Say that a bus went away; `why` may begin with its name."""
    reason = _plain(why.removeprefix(f"{channel}: "))
    return Mark(at_us, GONE, f"{_plain(channel)} is gone: {reason}", channel)


def back(at_us: int, channel: str, away_us: int) -> Mark:
    """Say that a bus is there again."""
    away = f"{away_us // 1_000_000}.{away_us % 1_000_000:06d}"
    return Mark(at_us, BACK, f"{_plain(channel)} is back after {away} s", channel, away_us=away_us)


def triggered(at_us: int, why: str) -> Mark:
    """Say what made somebody record this."""
    return Mark(at_us, TRIGGER, f"trigger: {_plain(why)}")


def lost_frames(comment: str) -> int:
    """Return how many frames a comment of a log says were lost; 0 for any other.

    >>> lost_frames("# 12 frames were lost"), lost_frames("# a note")
    (12, 0)
    >>> lost_frames("DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 1)")
    1
    """
    mark = read_mark(0, comment.removeprefix("#"))
    return mark.frames if mark else 0


def read_mark(at_us: int, text: str) -> Mark | None:
    """Return the mark that a log has in these words; None for others.

    >>> read_mark(5, "can0 is back after 3.250000 s") == back(5, "can0", 3_250_000)
    True
    """
    said = _SAID.fullmatch(text.strip())
    if said is None:
        return None
    if lost := said["lost"] or said["dropped"]:
        return dropped(at_us, int(lost))
    if said["trigger"]:
        return triggered(at_us, said["trigger"])
    if said["gone"]:
        return gone(at_us, said["gone"], said["why"])
    return back(at_us, said["back"], int(said["s"]) * 1_000_000 + int(said["us"]))


def _plain(text: str) -> str:
    """Return text in one line of ASCII, as all formats can hold it."""
    return " ".join(text.split()).encode("ascii", "backslashreplace").decode("ascii")

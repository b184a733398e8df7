"""What ends a check before its end.

StepFailed      the node did not do what the step says
NotAllowed      the level of the run does not allow what the step does
Disturbed       nothing can be said: the host, the bus or another node was in the way
"""

from __future__ import annotations

from collections.abc import Iterable


class StepFailed(Exception):  # noqa: N818 - what the step did
    """The node did something else, or nothing; the text says what came and what was allowed.

    Attributes:
        got: the frame that came, as candump writes it; empty if none did.
        wanted: patterns of the frame that should have come, one of them; none if none should.
    """

    def __init__(self, text: str, got: str = "", wanted: Iterable[str] = ()) -> None:
        super().__init__(text)
        self.got, self.wanted = got, tuple(wanted)


class NotAllowed(Exception):  # noqa: N818 - what the step is
    """A step would do what this run must not do; the text says what, and which level may."""


class Disturbed(Exception):  # noqa: N818 - what the check was
    """A check that cannot be judged; the text says why."""

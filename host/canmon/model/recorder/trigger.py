"""What makes somebody record: a frame that passes a filter, a rule that is broken."""

from __future__ import annotations

from typing import Protocol

from tickrig.host.canmon.model.check.alarms import Alarms
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.filter import Filter
from tickrig.host.canmon.model.decode.filter_terms import MissingSignals
from tickrig.host.canmon.model.frames import Record


class Trigger(Protocol):
    """Looks at each frame.

    Attributes:
        name: what people call it.
        decodes: it asks what frames mean.
    """

    name: str
    decodes: bool

    def why(self, record: Record, decoded: Decoded | None, /) -> str:
        """Say why this frame makes somebody record; nothing if it does not."""
        ...

    def missing(self, now_us: int, lost: int, /) -> str:
        """Say why what did not come until now, or was lost, does."""
        ...

    def messages(self) -> list[str]:
        """Say what else there is to know of it."""
        ...


class FilterTrigger:
    """Frames that pass a filter.

    Args:
        name: the filter as it is written.
        wanted: the filter.
    """

    def __init__(self, name: str, wanted: Filter) -> None:
        self.name, self.decodes, self._wanted = name, True, wanted
        self._missing = MissingSignals(wanted.signals, wanted.words)

    def why(self, record: Record, decoded: Decoded | None, /) -> str:
        """Return the filter if the frame passes."""
        assert decoded is not None, "who filters has decoded"
        if self._missing:
            self._missing.take(record, decoded)
        return self.name if self._wanted.matches(record, decoded) else ""

    def missing(self, now_us: int, lost: int, /) -> str:
        """Nothing: a filter is about what came."""
        return ""

    def messages(self) -> list[str]:
        """Say which signals it asks for that never came."""
        return self._missing.messages()


class RuleTrigger:
    """Findings of the rules of a check.

    Args:
        name: of the rules, as of their file.
        alarms: the rules.
    """

    def __init__(self, name: str, alarms: Alarms) -> None:
        self.name, self._alarms = name, alarms
        self.decodes = bool(alarms.rules.expressions)

    def why(self, record: Record, decoded: Decoded | None, /) -> str:
        """Return what is wrong with the frame."""
        self._alarms.take(record, decoded)
        return self._found()

    def missing(self, now_us: int, lost: int, /) -> str:
        """Return what is missing."""
        self._alarms.check_missing(now_us, lost)
        return self._found()

    def messages(self) -> list[str]:
        """Nothing."""
        return []

    def _found(self) -> str:
        """Return the first of the new findings; the others are of the same moment."""
        findings = self._alarms.findings
        if not findings:
            return ""
        first = findings[0]
        findings.clear()
        return f"{first.rule}: {first.text}"

"""The signals that a filter asks for and that have not come: a name may be misspelt."""

from __future__ import annotations

from collections.abc import Iterable

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.filter.filter_terms import signal_place


class MissingSignals:
    """Waits for signals by name.

    Args:
        paths: as filters write them: `position`, `3.position`, `statusword.fault`.
    """

    def __init__(self, paths: Iterable[str]) -> None:
        self._left = {path: signal_place(path)[:2] for path in sorted(paths)}

    def __bool__(self) -> bool:
        """Say whether any is missing."""
        return bool(self._left)

    def take(self, decoded: Decoded) -> None:
        """Take what a frame says."""
        names = {signal.name for signal in decoded.signals}
        self._left = {
            path: (node, name)
            for path, (node, name) in self._left.items()
            if name not in names or node not in (None, decoded.node)
        }

    def words(self) -> list[str]:
        """Say what never came, one line each."""
        return [f"the filter asks for {path!r}: no such signal came" for path in self._left]

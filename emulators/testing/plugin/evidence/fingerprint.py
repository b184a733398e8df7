"""All that is on the wires of a bench, and all that its devices show, line by line."""

from __future__ import annotations

from functools import partial
from hashlib import sha256
from itertools import zip_longest

from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.mounts import LineMount
from tickrig.emulators.testing.plugin.evidence.signal_names import signals_of
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame


class Fingerprint:
    """Takes down what happens on a bench: traffic as it passes, signals when they change.

    Args:
        rig: of the bench.

    Attributes:
        lines: what was taken down.
    """

    def __init__(self, rig: BenchRig) -> None:
        self._rig, self.lines = rig, list[str]()
        self._signals = signals_of(rig)
        self._values: dict[str, Setting] = {}
        for name, mount in rig.state.mounts.items():
            if isinstance(mount, LineMount):
                mount.tap.listeners.append(partial(self._pass, name))
            else:
                mount.wire.observers.append(partial(self._frame, name))
        rig.rig.watchers.append(self._look)
        self._look(rig.rig.now_us)

    def end(self) -> None:
        """Take down when it all ended."""
        self._take(self._rig.rig.now_us, "(the end)")

    @property
    def digest(self) -> str:
        """The hash of all that was taken down."""
        return sha256("\n".join(self.lines).encode()).hexdigest()

    def difference(self, other: Fingerprint) -> str:
        """Return the first line that is not the same in another run; empty if all are."""
        pairs = zip_longest(self.lines, other.lines, fillvalue="nothing")
        for number, (first, second) in enumerate(pairs, 1):
            if first != second:
                return f"line {number}\n  first run:  {first}\n  second run: {second}"
        return ""

    def _pass(self, wire: str, at_us: int, mark: Mark, data: bytes) -> None:
        self._take(at_us, f"{wire} {mark} {escape(data)}")

    def _frame(self, wire: str, at_us: int, frame: CanFrame | ErrorFrame) -> None:
        self._take(at_us, f"{wire} {frame}")

    def _look(self, now_us: int) -> None:
        for name, read in self._signals.items():
            value = read()
            if name not in self._values or self._values[name] != value:
                self._values[name] = value
                self._take(now_us, f"{name}={value}")

    def _take(self, at_us: int, text: str) -> None:
        self.lines.append(f"{format_time(at_us)} {text}")

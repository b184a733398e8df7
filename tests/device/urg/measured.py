"""A sensor with a host beside it, without a line."""

from __future__ import annotations

from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import UrgParameters, World
from tickrig.wire.scip import Command, Reply, ReplySplitter, parse_scan


class Measured:
    """A sensor that is ticked each millisecond, or only when it is due."""

    def __init__(
        self,
        world: World | None = None,
        *,
        dense: bool = True,
        noise: float = 0.0,
        seed: int = 0,
        scip: str = "2.0",
    ) -> None:
        self.urg = Urg(UrgParameters(noise=noise, seed=seed, scip=scip), world)
        self.now_us, self._dense = 0, dense
        self.sent: list[tuple[int, bytes]] = []

    def run(self, duration_ms: int, rx: bytes = b"") -> bytes:
        """Let time pass; return what the sensor sent."""
        out = b""
        for _ in range(duration_ms):
            self.now_us += 1_000
            if self._dense or rx or self.urg.due_us <= self.now_us:
                answer = self.urg.tick(self.now_us, rx)
                self.sent += [(self.now_us, answer)] if answer else []
                out, rx = out + answer, b""
        return out

    def replies(self, duration_ms: int, rx: bytes = b"") -> list[Reply]:
        """Let time pass; return the replies."""
        splitter = ReplySplitter()
        found = splitter.push(self.run(duration_ms, rx))
        assert splitter.garbled == 0
        return found

    def ask(self, line: str) -> str:
        """Send a line; return the status that is answered at once, empty without."""
        found = self.replies(1, line.encode() + b"\n")
        assert all(reply.echo == line.encode() for reply in found)
        return found[0].status if found else ""

    def scan(self, line: str = "GD0044072501") -> tuple[int, ...]:
        """Measure once, anew; return the distances."""
        self.ask("QT")
        self.ask("BM")
        (reply,) = self.replies(210, line.encode() + b"\n")
        assert reply.status == "00"
        width = 2 if Command.parse(line.encode()).symbol[1] == "S" else 3
        return parse_scan(reply.lines, width)[1]

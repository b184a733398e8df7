"""The reference of a drive on a planned path."""

from __future__ import annotations

from tickrig.device.canopen.core.slave import TICK_US
from tickrig.device.canopen.ds402.motion.reference import Reference
from tickrig.device.canopen.ds402.motion.trapezoid import Motion, Path
from tickrig.device.twin import Part


class PathFollower(Part):
    """Keeps the reference on a path, as long as nobody else moves it.

    The reference that a mode finds is that of the tick before: there a path begins.

    Args:
        reference: of the drive.
    """

    __slots__ = ("_left_at", "_path", "_reference")

    def __init__(self, reference: Reference) -> None:
        self._reference, self._path = reference, Path(0, Motion(0.0), ())
        self._left_at: tuple[float, float] | None = None

    @property
    def kept(self) -> bool:
        """Whether there is a path, and the reference is still on it."""
        return self._left_at == (self._reference.position, self._reference.velocity)

    @property
    def motion(self) -> Motion:
        """The present reference, where a path may begin."""
        return Motion(self._reference.position, self._reference.velocity)

    def begin(self, path: Path) -> None:
        """Take another path; it has to begin at `motion`, at `began_us`."""
        self._path, self._left_at = path, (self._reference.position, self._reference.velocity)

    def leave(self) -> None:
        """Have no path any more."""
        self._left_at = None

    def follow(self, now_us: int) -> bool:
        """Move the reference to where the path is now. Returns: whether the path has ended."""
        motion = self._path.at(now_us)
        self._reference.place(*motion)
        self._left_at = motion.position, motion.velocity
        return self._path.ended(now_us)


def began_us(now_us: int) -> int:
    """Return since when the reference is where a mode finds it in this tick, in microseconds."""
    return now_us - TICK_US

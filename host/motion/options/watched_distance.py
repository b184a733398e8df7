"""What two components make of a distance: is the way free?"""

from __future__ import annotations

from tickrig.host.motion.ports import newest, sound
from tickrig.host.rtc import ExecutionContext, InPort
from tickrig.wire.rtc_types.basic import TimedDouble


class WatchedDistance:
    """Blocked below one distance, free above another, and blocked when nothing is heard.

    Args:
        port: where distances arrive.

    Attributes:
        free: whether the way is free; not before the first distance.
    """

    def __init__(self, port: InPort[TimedDouble]) -> None:
        self._port, self.free, self._heard_us = port, False, 0

    def forget(self) -> None:
        """Begin anew."""
        self._port.clear()
        self.free, self._heard_us = False, 0

    def look(self, ec: ExecutionContext, stop_m: float, go_m: float, timeout_s: float) -> bool:
        """Take the newest distance; return whether the way is free."""
        latest = newest(self._port)
        if latest is not None and sound(latest.data):
            self._heard_us = ec.now_us
            self.free = latest.data > (stop_m if self.free else go_m)
        elif ec.now_us - self._heard_us > timeout_s * 1e6:
            self.free = False
        return self.free

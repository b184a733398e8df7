"""What joins devices beside their wires."""

from __future__ import annotations

from typing import Protocol


class Coupling(Protocol):
    """A body on the wheels of several drives, a belt between two shafts.

    It acts after all devices of a step have computed: it looks at their outputs
    and may set their inputs, which count in their next tick. So the order in which
    devices are listed cannot matter to it either.
    """

    @property
    def tick_us(self) -> int:
        """It acts at multiples of this."""
        ...

    @property
    def due_us(self) -> int:
        """When it would change something even if no device has work; see `Device.due_us`."""
        ...

    def act(self, now_us: int, /) -> None:
        """Look at outputs, set inputs."""

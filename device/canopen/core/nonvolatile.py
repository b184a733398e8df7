"""What a slave keeps when its power is cut."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Nonvolatile:
    """The non-volatile memory of one slave; an emulator may keep it in a file.

    Attributes:
        parameters: stored values by index << 8 | sub-index (1010h).
        node_id: node-ID stored by LSS, None if none was.
        bit_rate_index: bit timing index stored by LSS, None if none was.
        version: counts every change, so that an emulator knows when to write its file.
        program: downloaded (1F50h), empty where it was cleared; None for the one it was made with.
    """

    parameters: dict[int, bytes] = field(default_factory=dict)
    node_id: int | None = None
    bit_rate_index: int | None = None
    version: int = 0
    program: bytes | None = None

    def changed(self) -> None:
        """Note that something was stored or erased."""
        self.version += 1

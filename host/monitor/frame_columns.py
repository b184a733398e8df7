"""A log as columns: what `read_columns` gives, and what statistics ask of it; needs numpy."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.heard import Heard
from tickrig.host.monitor.ident import ERROR, EXTENDED, REMOTE
from tickrig.wire.can import EXTENDED_MAX, CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame


class FrameColumns(Protocol):
    """Frames in the order in which they were heard, a column for each of their parts."""

    @property
    def at_us(self) -> npt.NDArray[np.int64]:
        """When each had ended."""
        ...

    @property
    def ident(self) -> npt.NDArray[np.uint32]:
        """CAN-ID with flags, see `tickrig.host.monitor.ident`; of error frames their class."""
        ...

    @property
    def dlc(self) -> npt.NDArray[np.uint8]:
        """Data length codes."""
        ...

    @property
    def payload(self) -> npt.NDArray[np.uint64]:
        """Bytes as a little-endian number; bytes that are not there are 0."""
        ...

    @property
    def channel(self) -> npt.NDArray[np.uint8]:
        """Places in `channels`."""
        ...

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the buses."""
        ...


class Frames(NamedTuple):
    """Some frames of a log."""

    at_us: npt.NDArray[np.int64]
    ident: npt.NDArray[np.uint32]
    dlc: npt.NDArray[np.uint8]
    payload: npt.NDArray[np.uint64]
    channel: npt.NDArray[np.uint8]
    channels: tuple[str, ...]

    @classmethod
    def of(cls, columns: FrameColumns, rows: npt.NDArray[np.int64] | slice) -> Frames:
        """Return some rows of columns."""
        return cls(
            columns.at_us[rows],
            columns.ident[rows],
            columns.dlc[rows],
            columns.payload[rows],
            columns.channel[rows],
            columns.channels,
        )

    def heard(self, row: int) -> Heard:
        """Return one of them."""
        name = self.channels[self.channel[row]]
        ident, dlc = int(self.ident[row]), int(self.dlc[row])
        return Heard(int(self.at_us[row]), name, frame_of(ident, dlc, int(self.payload[row])))


def frame_of(ident: int, dlc: int, payload: int) -> CanFrame | ErrorFrame:
    """Return the frame that a row of columns stands for."""
    if ident & ERROR:
        return ErrorFrame(ident & ERROR_CLASS_MASK, payload.to_bytes(8, "little"))
    extended = bool(ident & EXTENDED)
    if ident & REMOTE:
        return CanFrame(ident & EXTENDED_MAX, b"", True, extended, dlc)
    data = payload.to_bytes(8, "little")[:dlc]
    return CanFrame(ident & EXTENDED_MAX, data, False, extended)

"""Columns from frames, without a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tickrig.host.monitor.frame_columns import Frames
from tickrig.host.monitor.heard import Heard
from tickrig.host.monitor.ident import ERROR, ident_of
from tickrig.wire.can import CanFrame


def columns(heards: Sequence[Heard]) -> Frames:
    channels = tuple(dict.fromkeys(heard.channel for heard in heards))
    frames = [heard.frame for heard in heards]
    return Frames(
        np.array([heard.at_us for heard in heards], np.int64),
        np.array(
            [
                ident_of(frame) if isinstance(frame, CanFrame) else ERROR | frame.error_class
                for frame in frames
            ],
            np.uint32,
        ),
        np.array([frame.dlc if isinstance(frame, CanFrame) else 8 for frame in frames], np.uint8),
        np.array([int.from_bytes(frame.data, "little") for frame in frames], np.uint64),
        np.array([channels.index(heard.channel) for heard in heards], np.uint8),
        channels,
    )

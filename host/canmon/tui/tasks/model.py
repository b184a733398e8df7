"""All that panels show of a source: frames in, nothing painted, no clock and no thread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tickrig.host.canmon.extensions import make_decoder
from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.node_board import NodeBoard
from tickrig.host.monitor.decode.node_memory import EdsObjects
from tickrig.host.monitor.frames.record import AnyRecord, Record
from tickrig.host.monitor.views.top_model import TopModel
from tickrig.host.monitor.views.trace import Trace

DecodedFrame = tuple[Record, Decoded]
"""A frame and what it means."""


class Model:
    """What was heard, decoded and counted.

    Args:
        eds: what files say, by node-ID.
        dbc: DBC files.
        bit_rate: of the buses, None if it is not known.

    Attributes:
        eds: what files say, by node-ID.
        decoder: decodes all that is taken here.
        board: the nodes.
        top: the traffic, and how the statistics show it.
        trace: the latest frames.
        frames: how many were taken, error frames among them.
        now_us: the time at the source.
        lost: frames that were there and did not get here.
        unread: what came and is no frame of classic CAN.
        failed: why the source ended before its time; empty if it did not.
        ended: no more will come.
    """

    def __init__(
        self,
        eds: Mapping[int, EdsObjects] | None = None,
        dbc: Sequence[Path] = (),
        bit_rate: int | None = None,
    ) -> None:
        self.eds = dict(eds or {})
        self.decoder = make_decoder(self.eds, dbc)
        self.board = NodeBoard(self.decoder, {node: found.name for node, found in self.eds.items()})
        self.top = TopModel(bit_rate)
        self.trace = Trace()
        self.frames = self.now_us = self.lost = self.unread = 0
        self.failed, self.ended = "", False

    def take(self, records: Sequence[AnyRecord]) -> list[DecodedFrame]:
        """Take what was heard; return the frames with what they mean."""
        decoded_frames: list[DecodedFrame] = []
        for record in records:
            if isinstance(record, Record):
                decoded = self.decoder.take(record)
                self.board.take(record, decoded)
                self.trace.take(record, decoded)
                decoded_frames.append((record, decoded))
            else:
                self.trace.take(record, record.decoded)
                self.top.take((record,))
        self.top.take_decoded(decoded_frames)
        self.frames += len(decoded_frames)
        if records:
            self.now_us = records[-1].at_us
        return decoded_frames

"""What frames mean, and which of them are wanted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tickrig.host.canmon.model.frames.record import Record

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.decode.decoder import Decoder
    from tickrig.host.canmon.model.decode.filter import Filter
    from tickrig.host.canmon.model.decode.filter_terms import MissingSignals
    from tickrig.host.canmon.model.frames.record import AnyRecord

DecodedFrame = tuple["AnyRecord", "Decoded | None"]
"""A frame or a line of a serial port, and what it means where somebody asked."""


class FilteredDecoder:
    """Decodes frames and passes on those that are wanted.

    Args:
        decoder: tells what frames mean; None where nobody asks.
        wanted: which frames pass; None for all. It needs a decoder.
    """

    def __init__(self, decoder: Decoder | None, wanted: Filter | None) -> None:
        self._decoder, self._wanted = decoder, wanted
        self._missing: MissingSignals | None = None
        if wanted is not None and wanted.signals:
            from tickrig.host.canmon.model.decode.filter_terms import (  # noqa: PLC0415 - slow
                MissingSignals,
            )

            self._missing = MissingSignals(wanted.signals)

    def take(self, records: Sequence[AnyRecord]) -> Iterator[DecodedFrame]:
        """Pass on what is wanted; all frames are decoded, for the decoder learns from each."""
        decoder, wanted, missing = self._decoder, self._wanted, self._missing
        for record in records:
            if decoder is None:
                decoded = None
            else:
                decoded = decoder.take(record) if isinstance(record, Record) else record.decoded
            if missing and decoded is not None:
                missing.take(decoded)
            if wanted is None or (decoded is not None and wanted.matches(record, decoded)):
                yield record, decoded

    def messages(self) -> list[str]:
        """Say which signals the filter asks for that never came, one line each."""
        return [] if self._missing is None else self._missing.messages()

"""The meaning of frames, the filter for wanted frames, and the output of `dump` for each frame."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum
from math import isfinite
from typing import TYPE_CHECKING, Final, TextIO

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import DumpLines, Record, decoded_text, line_text
from tickrig.host.canmon.model.logs.log_file import Mark, dropped
from tickrig.host.canmon.model.logs.log_writer import comment, log_line
from tickrig.host.canmon.model.logs.notation import DUMP_HEADER, drop_line, json_line, line_json
from tickrig.host.cli.start import as_is, write_harmless
from tickrig.host.text.page_text import json_text, one_line
from tickrig.host.text.values import counted
from tickrig.wire.can import CanFrame, ErrorFrame

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_meanings, column_text
    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.decode import filter as filters
    from tickrig.host.canmon.model.decode import services
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.decode.decoder import Decoder
    from tickrig.host.canmon.model.decode.filter import Filter
    from tickrig.host.canmon.model.frames import AnyRecord
    from tickrig.host.canmon.sources.source import LogCut
else:  # slow; seldom wanted; numpy
    column_meanings = LazyModule("tickrig.host.canmon.model.columns.column_meanings")
    column_text = LazyModule("tickrig.host.canmon.model.columns.column_text")
    filters = LazyModule("tickrig.host.canmon.model.decode.filter")
    services = LazyModule("tickrig.host.canmon.model.decode.services")


# Decoding and filtering of frames.

DecodedFrame = tuple["AnyRecord", "Decoded | None"]
"""A frame or a line of a serial port, and its meaning if it is decoded."""


class FilteredDecoder:
    """Decoder of frames that drops the frames which do not pass a filter.

    Args:
        decoder: decoder of frames, or None to leave frames undecoded.
        wanted: filter that frames must pass, or None for all frames. A filter needs a decoder.

    Attributes:
        taken: number of frames that were processed.
        passed: whether any frame has passed the filter.
    """

    def __init__(self, decoder: Decoder | None, wanted: Filter | None) -> None:
        self._decoder, self._wanted = decoder, wanted
        self.taken, self.passed = 0, False
        self._missing: filters.MissingSignals | None = None
        if wanted is not None and (wanted.signals or wanted.words):
            self._missing = filters.MissingSignals(wanted.signals, wanted.words)

    def learning(self, cut: LogCut) -> LogCut:
        """Return a `LogCut` that selects the same part of a log as `cut`.

        With the result, the decoder also learns from the frames before this part: the reader of the
        log passes these frames to the decoder. The command does not print them.
        """
        if self._decoder is None or cut.begin is None:
            return cut
        return replace(cut, earlier=self._decoder.take)

    def take(self, records: Sequence[AnyRecord]) -> Iterator[DecodedFrame]:
        """Decode frames, and yield those that pass the filter.

        Frames that do not pass are decoded, too, because the decoder learns from each frame.
        """
        decoder, wanted, missing = self._decoder, self._wanted, self._missing
        self.taken += len(records)
        for record in records:
            if decoder is None:
                decoded = None
            else:
                decoded = decoder.take(record) if isinstance(record, Record) else record.decoded
            if missing and decoded is not None:
                missing.take(record, decoded)
            if wanted is None or (decoded is not None and wanted.matches(record, decoded)):
                self.passed = True
                yield record, decoded

    @property
    def nothing_passed(self) -> bool:
        """Whether there were frames, but no frame passed the filter."""
        return self._wanted is not None and self.taken > 0 and not self.passed

    def messages(self) -> list[str]:
        """Return one line for each signal or kind of frame in the filter that never occurred.

        If all of them occurred, but no frame passed the filter, the result is one line that states
        this.
        """
        said = [] if self._missing is None else self._missing.messages()
        if not said and self.nothing_passed and self._wanted is not None:
            frames = counted(self.taken, "frame")
            said.append(f"-F {self._wanted.text!r}: none of {frames} passes")
        return said


# Output of `dump` for each frame: candump's lines, its log format, JSON or CSV.

_Printer = Callable[["AnyRecord", "Decoded | None"], str]
"""Function that prints a frame, or a line of a serial port, with its meaning if it is known."""


class DumpFormat(StrEnum):
    """Output format of frames."""

    TEXT = ""
    LOG = "log"
    JSONL = "jsonl"
    CSV = "csv"


def printer_of(output: DumpFormat, lines: DumpLines, raw: bool, errors: bool = False) -> _Printer:
    """Return a function that formats a frame as a line of the chosen output format.

    Args:
        output: format of the output.
        lines: formatter of text lines.
        raw: whether to omit the decoded meaning of frames.
        errors: whether to show the meaning of error frames, even if `raw` is set.
    """
    write = _writer(output, lines)
    if not raw:
        return write
    if errors:
        return lambda record, _: write(record, _error_meaning(record))
    return lambda record, _: write(record, None)


def _writer(output: DumpFormat, lines: DumpLines) -> _Printer:
    printers = {
        DumpFormat.TEXT: _text_printer(lines),
        DumpFormat.LOG: _log_printer,
        DumpFormat.JSONL: _json_printer,
        DumpFormat.CSV: csv_printer,
    }
    return printers[output]


def _error_meaning(record: AnyRecord) -> Decoded | None:
    if not isinstance(record.frame, ErrorFrame):
        return None
    return services.decode_error(record.frame)


def _text_printer(lines: DumpLines) -> _Printer:
    """Return a function that writes lines as candump shows them."""

    def printed(record: AnyRecord, decoded: Decoded | None) -> str:
        text = one_line(decoded_text(decoded))
        if isinstance(record, Record):
            return lines.line(record, text)
        return f"{lines.stamp(record.at_us)}  {line_text(record, text)}"

    return printed


def _log_printer(record: AnyRecord, decoded: Decoded | None) -> str:
    """Write a line of a log, which holds only frames."""
    assert isinstance(record, Record), "who opens serial ports does not ask for a log"
    return log_line(record)


def _json_printer(record: AnyRecord, decoded: Decoded | None) -> str:
    """Write a JSON object with kind, node, text, signals and their source."""
    more = "" if decoded is None else _meaning_json(decoded)
    if isinstance(record, Record):
        return json_line(record, more)
    return line_json(record, more)


def _meaning_json(decoded: Decoded) -> str:

    node = "" if decoded.node is None else f',"node":{decoded.node}'
    text = f',"text":{json_text(decoded.text)}' if decoded.text else ""
    values = {signal.name: _plain(signal.value) for signal in decoded.signals}
    signals = f',"sig":{json_text(values, compact=True)}' if values else ""
    source = f',"src":"{decoded.source}"' if decoded.source else ""
    return f',"kind":"{decoded.kind}"{node}{text}{signals}{source}'


def csv_printer(record: AnyRecord, decoded: Decoded | None) -> str:
    """Write a row below `DUMP_HEADER`. A line of a serial port has no identifier."""
    at_us, channel, sent = record.at_us, record.channel, record.sent
    if isinstance(record, Record):
        frame = record.frame
        text, _, data = str(frame).partition("#")
        length = frame.dlc if isinstance(frame, CanFrame) else len(frame.data)
    else:
        text, data, length = "", record.data.hex().upper(), len(record.data)
    meaning = ("", "", "")
    if decoded is not None:
        node = "" if decoded.node is None else str(decoded.node)
        meaning = (decoded.kind, node, _cell(decoded.text))
    at_s = f"{at_us // 1_000_000}.{at_us % 1_000_000:06d}"
    cells = (at_s, _cell(channel), text, "tx" if sent else "rx", str(length), data, *meaning)
    return ",".join(cells)


def _plain(value: object) -> object:
    """Return a value for JSON. Bytes become hex, and a NaN or infinity becomes null."""
    if isinstance(value, float) and not isfinite(value):
        return None
    return value.hex().upper() if isinstance(value, bytes | bytearray) else value


def _cell(text: str) -> str:
    """Quote a cell that needs quotes (RFC 4180)."""
    quoted = text.replace('"', '""')
    return f'"{quoted}"' if set(text) & set(',"\r\n') else text


class BlockPrinter:
    """Formatter of many frames at once. It is faster than `printer_of`, with the same output.

    Args:
        output: format of the output, which is text or a log.
        lines: formatter of single lines. The two formatters may be used in turn, because each
            continues where the other formatter ended.
        decoder: decoder of frames, or None for no decoding. Other code may decode frames with it
            between two calls.
    """

    def __init__(self, output: DumpFormat, lines: DumpLines, decoder: Decoder | None) -> None:
        self._output, self._screen, self._decode = output, column_text.ScreenText(lines), None
        if decoder is not None:
            self._decode = column_meanings.ColumnMeanings(decoder).texts

    def texts(self, columns: Columns) -> Iterator[str]:
        """Format the frames of a block, and yield texts of whole lines.

        Control codes in the frames' texts have no effect on the terminal.
        """
        if self._output is DumpFormat.LOG:
            return iter([column_text.log_lines(columns)])
        return self._screen.texts(columns, self._decode and self._decode(columns))


_DROPS: Final = {
    DumpFormat.LOG: lambda lost: comment(dropped(0, lost)),
    DumpFormat.JSONL: drop_line,
}
_MARKS: Final = {DumpFormat.LOG: comment, DumpFormat.JSONL: Mark.json}


class StdoutWriter:
    """Writer that prints frames on standard output in the format of `canmon dump`.

    If the format is JSON or a log, each event between frames is also a line.

    Control characters in the text are replaced, so that they cannot affect a terminal. They are
    kept in one case: the format is log or CSV, and standard output is not a terminal. Other
    programs then receive the exact text.
    """

    def __init__(self, printer: _Printer, output: DumpFormat) -> None:
        self._printer, self._output, self._lost = printer, output, 0
        self._header = output is DumpFormat.CSV
        # JSON has nothing that a terminal obeys
        machine = output in (DumpFormat.LOG, DumpFormat.CSV)
        self._shown = not machine or sys.stdout.isatty()

    def take(
        self, decoded_frames: Sequence[DecodedFrame], lost: int, marks: Sequence[Mark] = ()
    ) -> bool:
        """Print frames at once. Return False, because the writer never ends the reading."""
        lines = [DUMP_HEADER] if self._header else []
        lines += [self._printer(*one) for one in decoded_frames]
        if lost != self._lost and (said := _DROPS.get(self._output)):
            lines.append(said(lost - self._lost))
        if marks and (write := _MARKS.get(self._output)):
            lines += map(write, marks)
        self._header, self._lost = False, lost
        if lines:
            stream = self._stream()
            stream.write("\n".join(lines) + "\n")
            stream.flush()
        return False

    def take_block(self, texts: Iterable[str], lost: int) -> None:
        """Print the lines of a block as `BlockPrinter.texts` returns them."""
        stream = self._stream()
        for text in texts:
            write_harmless(stream, text)
        stream.flush()
        self.take((), lost)

    def _stream(self) -> TextIO:
        return sys.stdout if self._shown else as_is(sys.stdout)

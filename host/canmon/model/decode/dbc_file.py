"""Signals of a DBC file, decoded by cantools."""

from __future__ import annotations

from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING

from tickrig.host.canmon.model.decode.decoded import DBC, Decoded, Signal
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import ErrorFrame
from tickrig.wire.canopen.datatypes import Value

if TYPE_CHECKING:
    from cantools.database.can import Message
    from cantools.database.can import Signal as SignalOfDbc
    from cantools.database.namedsignalvalue import NamedSignalValue
    from cantools.typechecking import SignalDictType


class DbcError(ValueError):
    """A file that is not a DBC file, or cantools is not installed."""


class DbcFile:
    """Decoder for the frames that a DBC file describes. It takes precedence over other decoders.

    Args:
        path: path of the DBC file, which is in UTF-8 or Windows-1252.

    Raises:
        OSError: the file cannot be read.
        DbcError: the file is malformed, or the extra `dbc` with the package cantools is not
            installed.
    """

    def __init__(self, path: Path) -> None:
        try:
            from cantools import Error  # noqa: PLC0415 - slow, and an extra
            from cantools.database import load_string  # noqa: PLC0415
            from cantools.database.can import Database  # noqa: PLC0415
        except ImportError as error:
            raise DbcError("DBC files need cantools: pip install 'tickrig[dbc]'") from error
        text = _text(path.read_bytes())
        try:
            database = load_string(text, "dbc", strict=False)
        except (Error, ValueError, KeyError) as error:
            raise DbcError(f"{path} is no DBC: {' '.join(str(error).split())}") from error
        # of a float that is infinite it looks up the name of a whole number: OverflowError
        self._failures = (Error, ArithmeticError, ValueError, KeyError)
        self._alone: dict[tuple[int, bool], dict[str, Message]] = {}
        assert isinstance(database, Database)  # as the format says
        self._messages: dict[tuple[int, bool], Message] = {
            (message.frame_id, message.is_extended_frame): message for message in database.messages
        }
        self._units = {
            ident: {signal.name: signal.unit or "" for signal in message.signals}
            for ident, message in self._messages.items()
        }

    def names(self, can_id: int, extended: bool) -> bool:
        """Return whether the file has a message with a CAN-ID."""
        return (can_id, extended) in self._messages

    def message(self, can_id: int, extended: bool) -> Message:
        """Return the message that the file defines for a CAN-ID."""
        return self._messages[can_id, extended]

    def decode(self, record: Record) -> Decoded | None:
        """Return the meaning of a frame, or None if the DBC file has no message with its CAN-ID.

        Args:
            record: frame, with its bus and time.
        """
        frame = record.frame
        if isinstance(frame, ErrorFrame):
            return None
        ident = frame.can_id, frame.extended
        message = self._messages.get(ident)
        if message is None:
            return None
        if frame.remote:
            return Decoded("dbc", None, f"{message.name} asked for by RTR", (), DBC)
        note = list[str]()
        try:
            found = message.decode_simple(frame.data, allow_truncated=True)
        except self._failures as error:
            found, failed = self._chosen(ident, message, frame.data)
            if failed:
                note = [f"(cannot be decoded: {', '.join(failed)})"]
            elif message.is_multiplexed():
                note = [f"({error})"]
            if not found and not failed:
                return Decoded("dbc", None, f"{message.name}: {error}", (), DBC)
        units = self._units[ident]  # DBCs made from EDS have several messages of one name
        signals = tuple(signal_of(name, value, units[name]) for name, value in found.items())
        return Decoded(
            "dbc", None, " ".join([message.name, *map(str, signals), *note]), signals, DBC
        )

    def _chosen(
        self, ident: tuple[int, bool], message: Message, data: bytes
    ) -> tuple[SignalDictType, list[str]]:
        """Return the signals of a frame that cantools does not decode, and the names of the rest.

        cantools returns no signal if a multiplexer has a value without signals, or if a signal
        overlaps another signal or exceeds the message. In these cases, each signal is decoded by
        itself. Signals without a multiplexer are returned, and signals that the value of their
        multiplexer selects. The rest are selected signals that cannot be decoded.
        """
        failed: list[str] = []
        if ident not in self._alone:
            self._alone[ident] = {one.name: _alone(message, one) for one in message.signals}
        raw: SignalDictType = {}
        found: SignalDictType = {}
        selectors: list[str | None] = [None]
        for selector in selectors:
            for signal in message.signals:
                ids = signal.multiplexer_ids
                if signal.multiplexer_signal != selector:
                    continue
                if selector is not None and ids is not None and raw.get(selector) not in ids:
                    continue
                alone = self._alone[ident][signal.name]
                try:
                    raw |= alone.decode_simple(data, False, False, allow_truncated=True)
                    found |= alone.decode_simple(data, allow_truncated=True)
                except self._failures:
                    failed.append(signal.name)
                    continue
                selectors += [signal.name] if signal.is_multiplexer else []
        return found, failed


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _alone(message: Message, signal: SignalOfDbc) -> Message:
    """Return the message with only one of its signals, which no multiplexer selects."""
    from cantools.database.can import Message as NewMessage  # noqa: PLC0415 - slow, and an extra

    one = copy(signal)
    one.is_multiplexer, one.multiplexer_ids, one.multiplexer_signal = False, None, None
    return NewMessage(
        message.frame_id,
        message.name,
        message.length,
        [one],
        is_extended_frame=message.is_extended_frame,
        strict=False,
    )


def signal_of(name: str, value: Value | NamedSignalValue, unit: str) -> Signal:
    """Return a signal. An enumerated signal has its name as text."""
    if isinstance(value, bool | int | float | str | bytes):
        return Signal(name, value, unit)
    return Signal(name, value.value, unit, value.name)

"""What SDO frames in columns mean, as a text for each, the same as frame by frame; needs numpy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns import cells
from tickrig.host.canmon.model.columns.columns import Columns, Ints
from tickrig.host.canmon.model.decode.decoded import Decoded, TransferDirection
from tickrig.host.canmon.model.decode.decoder import TEACHING
from tickrig.host.canmon.model.decode.node_memory import STATUSWORD, NodeMemory, ObjectText
from tickrig.host.canmon.model.decode.sdo import SdoChannel
from tickrig.host.canmon.model.frames import REMOTE, decoded_text
from tickrig.host.text.page_text import one_line
from tickrig.wire.can import EXTENDED_MAX, CanFrame
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.sdo_frame import ClientCommand, ServerCommand

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.decoder import BusDecoder

# Theory of operation
# ===================
#
# What an SDO frame means depends on those before it: `SdoChannel` follows the dialogue, 10 us a
# frame. But nearly all frames are pairs: a request, and behind it, on this channel, the answer.
# Whether a pair continues the dialogue depends only on the pair before it (`_BEFORE`, `_AFTER`):
# an expedited transfer or an abort needs a channel without a transfer and leaves one, the first
# segment needs a pair that opened a transfer, and so on. So one numpy call finds all chains of
# pairs. `SdoChannel` says at which of them it stands (`turn`); the whole chain is written at once,
# and the channel continues behind it. It also takes the segments of a block at once. All other
# frames it takes one by one: that is the rule, and the chains are an exception that must write the
# same.
#
# All frames here may be taken in any order of channels, and texts may be written later than a
# channel has gone on, because the caller (`column_meanings`) cuts a log where a transfer may teach
# something: `teachers` finds these rows. Values that change no meaning are not kept in the
# `NodeMemory`.
#
# The texts are those of `SdoChannel` and `BusDecoder`, for one sample of each kind. Transfers of
# one object differ in a value and a duration, which are put into the text of the sample.

_Words = npt.NDArray[np.uint64]

_FEW: Final = 16
"""Transfers that are written one by one sooner than at once."""
_MOST_TEXTS: Final = 1 << 14
"""Texts, and writers of them, that are kept."""
_SHORT: Final = 64
"""Bytes of a transfer whose text is kept."""
_WHOLE: Final = 8
_LOW: Final = np.uint64(0xFFFF_FFFF)
_HIGH: Final = np.uint64(32)
_NO_TIME: Final = "0.0 ms)"
"""How the text of a transfer without a duration ends."""
_UNUSED: Final = -1

# Kinds of pairs.
_UPLOAD, _DOWNLOAD, _ABORT, _OPENS_UPLOAD, _OPENS_DOWNLOAD = 1, 2, 3, 4, 5
_UPLOADS, _DOWNLOADS = 6, 8
"""A segment with toggle bit 0; the next number is that with toggle bit 1."""
_BEFORE: Final = np.array([_UNUSED, 0, 0, 0, 0, 0, 1, 2, 3, 4], np.int8)
_AFTER: Final = np.array([_UNUSED, 0, 0, 0, 1, 3, 2, 1, 4, 3], np.int8)
"""As `SdoChannel.turn`, before and after each kind of pair, unless it has the last segment."""


def _toggled(specifier: int) -> tuple[range, range]:
    return tuple(  # type: ignore[return-value] # two of them
        range(specifier | toggle, (specifier | toggle) + sdo_frame.TOGGLE)
        for toggle in (0, sdo_frame.TOGGLE)
    )


def _all_of(specifier: int, wanted: int | None = None) -> list[int]:
    """Return the command bytes with a specifier; expedited ones, or others, if that is wanted."""
    codes = range(specifier, specifier + 0x20)
    return [one for one in codes if wanted is None or one & sdo_frame.EXPEDITED == wanted]


@lru_cache(1)
def _kinds() -> npt.NDArray[np.int8]:
    """Return the kind of a pair by the command bytes of request and answer."""
    kinds = np.zeros((0x100, 0x100), np.int8)
    asks, sends, fast = ClientCommand.UPLOAD, ClientCommand.DOWNLOAD, sdo_frame.EXPEDITED
    answers, takes = ServerCommand.UPLOAD, ServerCommand.DOWNLOAD
    table: list[tuple[Iterable[int], Iterable[int], int]] = [
        (_all_of(asks), _all_of(answers, fast), _UPLOAD),
        (_all_of(asks), _all_of(answers, 0), _OPENS_UPLOAD),
        (_all_of(sends, fast), _all_of(takes), _DOWNLOAD),
        (_all_of(sends, 0), _all_of(takes), _OPENS_DOWNLOAD),
        (_all_of(asks) + _all_of(sends), _all_of(ServerCommand.ABORT), _ABORT),
    ]
    for client, server, kind in (
        (ClientCommand.UPLOAD_SEGMENT, ServerCommand.UPLOAD_SEGMENT, _UPLOADS),
        (ClientCommand.DOWNLOAD_SEGMENT, ServerCommand.DOWNLOAD_SEGMENT, _DOWNLOADS),
    ):
        both = zip(_toggled(client), _toggled(server), strict=True)
        table += [(*codes, kind + toggle) for toggle, codes in enumerate(both)]
    for requests, responses, kind in table:
        kinds[np.ix_(list(requests), list(responses))] = kind
    return kinds


@lru_cache(1)
def _teaching() -> npt.NDArray[np.bool_]:
    """Return by index whether the value of an object can change what other frames mean."""
    found = np.zeros(0x1_0000, np.bool_)
    found[list(TEACHING)] = True
    return found


_TEACHING_ANSWERS: Final = (
    ServerCommand.UPLOAD,
    ServerCommand.DOWNLOAD,
    ServerCommand.BLOCK_DOWNLOAD,
    ServerCommand.BLOCK_UPLOAD,
)


_EXPEDITED_ANSWER: Final = ServerCommand.UPLOAD | sdo_frame.EXPEDITED
_SIZE_BITS: Final = 0x0C | sdo_frame.SIZE_INDICATED
_TWO_BYTES: Final = 2 << 2 | sdo_frame.SIZE_INDICATED


def teachers(frames: Columns, rows: Ints, memory: NodeMemory) -> Ints:
    """Return the rows of SDO answers from which the decoder may learn something about the node.

    These answers begin or end the transfer of an object such as a PDO mapping. They must be decoded
    one by one.

    Args:
        frames: frames of one bus.
        rows: rows of the answers that one SDO server sends.
        memory: known objects of the node with this server.
    """
    words = frames.payload[rows]
    index = (words >> np.uint64(8) & np.uint64(0xFFFF)).astype(np.int64)
    found = _teaching()[index]
    if not memory.has_statusword:
        state = index == STATUSWORD[0]
        if memory.describe(*STATUSWORD).kind is None:  # then only two bytes are a statusword
            fast = words & np.uint64(sdo_frame.SPECIFIER | sdo_frame.EXPEDITED) == _EXPEDITED_ANSWER
            state &= ~fast | (words & np.uint64(_SIZE_BITS) == _TWO_BYTES)
        found |= state
    found &= np.isin(words & np.uint64(sdo_frame.SPECIFIER), _TEACHING_ANSWERS)
    found &= (frames.dlc[rows] == _WHOLE) & (frames.ident[rows] & np.uint32(REMOTE) == 0)
    return rows[found]


def teaches(entry: tuple[int, int], memory: NodeMemory) -> bool:
    """Return whether the decoder may learn something from the transferred value of an object.

    The decoder learns from the values of communication objects, such as COB-IDs and PDO mappings.
    It also learns from a transfer of the statusword, until a statusword with a length of 16 bits
    is known.

    Args:
        entry: index and sub-index of the object.
        memory: known objects of the node.
    """
    return entry[0] in TEACHING or (entry == STATUSWORD and not memory.has_statusword)


def _next_by_two(marks: npt.NDArray[np.bool_]) -> Ints:
    """Return for each place the first marked one from it on, in steps of two."""
    count = len(marks)
    found = np.empty(count, np.int64)
    for begin in (0, 1):
        places = np.where(marks[begin::2], np.arange(begin, count, 2), count + 1)
        found[begin::2] = np.minimum.accumulate(places[::-1])[::-1]
    return found


class _Frames(NamedTuple):
    """SDO frames of 8 bytes, channel by channel; a row for each.

    Attributes:
        at_us: time of each frame.
        word: data of each frame, as a number.
        node: node-ID of the server.
        asks: whether the client sent the frame.
        place: row of the frame in the texts.
        kind: kind of pair that begins with the frame; 0 if no pair begins with it.
        before: value of `SdoChannel.turn` before the pair.
        after: value of `SdoChannel.turn` after the pair.
        chain: last pair of the chain that begins with the pair.
        done: next pair, in steps of two, that ends a transfer.
        run: row after the last frame that can be a segment of the same block.
    """

    at_us: Ints
    word: _Words
    node: Ints
    asks: npt.NDArray[np.bool_]
    place: Ints
    kind: npt.NDArray[np.int8]
    before: npt.NDArray[np.int8]
    after: npt.NDArray[np.int8]
    chain: Ints
    done: Ints
    run: Ints

    @classmethod
    def of(cls, frames: Columns, rows: Ints, places: Ints, side: _Sides) -> _Frames:
        """Return the SDO frames of a bus, in which each request is paired with its answer.

        Args:
            frames: frames of the bus. They are a part of a block with the frames of all buses.
            rows: indices in `frames` of the SDO frames.
            places: index in the block for each frame in `frames`.
            side: three values for each frame in `frames`: SDO channel, node-ID, and whether the
                client sent the frame.
        """
        order = np.argsort(side.channel[rows], kind="stable")
        rows = rows[order]
        word, asks, channel = frames.payload[rows], side.asks[rows], side.channel[rows]
        command = (word & np.uint64(0xFF)).astype(np.uint8)
        entry = word >> np.uint64(8) & np.uint64(0xFF_FFFF)
        together = channel[1:] == channel[:-1]
        kind = np.zeros(len(rows), np.int8)
        kind[:-1] = _kinds()[command[:-1], command[1:]]
        named = (kind[:-1] >= _UPLOADS) | (entry[1:] == entry[:-1])
        kind[:-1] *= together & asks[:-1] & ~asks[1:] & named
        after, last = _AFTER[kind], np.zeros(len(rows), np.bool_)
        last[:-1] = np.where(kind[:-1] >= _DOWNLOADS, command[:-1], command[1:]) & sdo_frame.LAST
        after[last & (kind >= _UPLOADS)] = 0
        before = _BEFORE[kind]
        ends = np.ones(len(rows), np.bool_)
        ends[:-2] = (kind[:-2] == 0) | (after[:-2] != before[2:]) | ~(together[:-1] & together[1:])
        numbered = command & sdo_frame.BLOCK_SEQNO != 0
        cuts = np.ones(len(rows), np.bool_)
        cuts[:-1] = ~together | (asks[1:] != asks[:-1]) | ~numbered[1:]
        run = np.where(cuts, np.arange(1, len(rows) + 1), len(rows))
        run = np.where(numbered, np.minimum.accumulate(run[::-1])[::-1], 0)
        return cls(
            *(frames.at_us[rows], word, side.node[rows], asks, places[rows], kind, before, after),
            *(_next_by_two(ends), _next_by_two((kind != 0) & (after == 0)), run),
        )

    def data(self, row: int) -> bytes:
        """Return the data of a frame."""
        return int(self.word[row]).to_bytes(_WHOLE, "little")


class _Sides(NamedTuple):
    """Who speaks with whom, for each frame of a bus."""

    channel: npt.NDArray[np.int16]
    node: Ints
    asks: npt.NDArray[np.bool_]


class _Part(NamedTuple):
    """Pairs that are written at once: from the row of the first to that of the last.

    Attributes:
        first: row of the first pair.
        last: row of the last pair.
        received: number of bytes of the running transfer before the first pair.
        size: size of this transfer in bytes, 0 if unknown.
    """

    first: int
    last: int
    received: int = 0
    size: int = 0


class ColumnSdo:
    """Decoder for the SDO frames of a bus. It processes whole blocks of frames, with numpy.

    Args:
        bus: decoder for single frames of this bus. Between two calls of `take`, the caller may
            decode frames with it.
    """

    def __init__(self, bus: BusDecoder) -> None:
        self._bus, self._known = bus, 0
        self._heads = cells.TextTable(7, lambda node: f"{node} sdo ")
        self._texts: dict[Any, str] = {}
        self._writers: dict[tuple[int, int, int], _ValueText] = {}

    def take(
        self,
        frames: Columns,
        speakers: Sequence[tuple[SdoChannel, bool, Ints]],
        places: Ints,
        texts: cells.Texts,
    ) -> None:
        """Write the meanings of the SDO frames of one bus into the texts of a block of frames.

        The caller must not pass frames that may change what is known about a node, such as a frame
        that writes a PDO mapping.

        Args:
            frames: frames of the bus in the block.
            speakers: senders of the SDO frames. Each sender has three values: the SDO channel,
                whether the sender is the client, and the rows of its frames in `frames`.
            places: one value for each row of `frames`: the index of its text in `texts`.
            texts: texts of the block. The method adds the meanings to them.
        """
        known = self._bus.version
        if known != self._known or len(self._texts) + len(self._writers) > _MOST_TEXTS:
            self._texts.clear()
            self._writers.clear()
        self._known, count = known, len(frames)
        side = _Sides(np.zeros(count, np.int16), np.zeros(count, np.int64), np.zeros(count, bool))
        numbers = dict[SdoChannel, int]()
        for channel, asks, rows in speakers:
            side.channel[rows] = numbers.setdefault(channel, len(numbers))
            side.node[rows], side.asks[rows] = channel.node, asks
        rows = np.sort(np.concatenate([rows for _, _, rows in speakers]))
        remote = frames.ident[rows] & np.uint32(REMOTE) != 0
        odd = remote | (frames.dlc[rows] != _WHOLE)
        if odd.any():
            self._odd(frames, rows[odd], places, texts)
            rows = rows[~odd]
        if not len(rows):
            return
        dialogue = _Frames.of(frames, rows, places, side)
        cuts = np.searchsorted(np.sort(side.channel[rows]), np.arange(len(numbers) + 1)).tolist()
        talk = _Talk(self._bus, dialogue, texts)
        for channel, begin, end in zip(numbers, cuts, cuts[1:], strict=False):
            talk.follow(channel, begin, end)
        if talk.blocks:
            self._write_blocks(dialogue, talk.blocks, texts)
        if talk.parts:
            self._write(dialogue, talk.parts, texts)

    def _odd(self, frames: Columns, rows: Ints, places: Ints, texts: cells.Texts) -> None:
        """Take frames that are no SDO frames by their form; they change nothing."""
        kinds = frames.ident[rows].astype(np.int64) << 4 | frames.dlc[rows]
        _, firsts, which = np.unique(kinds, True, True)
        said = []
        for row in rows[firsts].tolist():
            ident, length = int(frames.ident[row]), int(frames.dlc[row])
            remote = bool(ident & REMOTE)
            data = b"" if remote else bytes(length)
            frame = CanFrame(ident & EXTENDED_MAX, data, remote, False, length)
            said.append(_text(self._bus.take(0, frame)))
        texts.put(places[rows], cells.of_texts(said)[which])

    def _write(self, dialogue: _Frames, parts: Sequence[_Part], texts: cells.Texts) -> None:
        """Write chains of pairs."""
        rows = np.concatenate([np.arange(one.first, one.last + 1, 2) for one in parts])
        kind = dialogue.kind[rows]
        begins = kind < _UPLOADS
        self._write_requests(dialogue, rows[begins], texts)
        self._write_answers(dialogue, rows[kind <= _ABORT], texts)
        if (kind > _ABORT).any():
            self._write_segments(dialogue, rows, parts, texts)

    def _write_requests(self, dialogue: _Frames, rows: Ints, texts: cells.Texts) -> None:
        """Write what begins transfers; it has one text for each object."""
        if not len(rows):
            return
        keys = dialogue.node[rows].astype(np.uint64) << _HIGH | dialogue.word[rows] & _LOW
        found, which = np.unique(keys, return_inverse=True)
        said = [self._request_text(key >> 32, key & 0xFFFF_FFFF) for key in found.tolist()]
        texts.put(dialogue.place[rows], cells.of_texts(said)[which])

    def _request_text(self, node: int, request: int) -> str:
        key = node, request
        if key not in self._texts:
            step = SdoChannel(node).request(0, request.to_bytes(_WHOLE, "little"))
            self._texts[key] = _text(Decoded("sdo", node, step.text))
        return self._texts[key]

    def _write_answers(self, dialogue: _Frames, rows: Ints, texts: cells.Texts) -> None:
        """Write what ends transfers of two frames, those of one object at once."""
        if not len(rows):
            return
        kind, request, answer = dialogue.kind[rows], dialogue.word[rows], dialogue.word[rows + 1]
        sends = (kind == _DOWNLOAD) | (
            (kind == _ABORT)
            & (request & np.uint64(sdo_frame.SPECIFIER) == ClientCommand.DOWNLOAD)
            & (request & np.uint64(sdo_frame.EXPEDITED) != 0)
        )
        value = np.where(sends, request, np.where(kind == _UPLOAD, answer, np.uint64(0))) >> _HIGH
        request = dialogue.node[rows].astype(np.uint64) << _HIGH | request & _LOW
        answer = np.where(kind == _ABORT, answer, answer & _LOW)
        lasted = _durations(dialogue.at_us[rows + 1] - dialogue.at_us[rows])
        place = dialogue.place[rows + 1]
        requests, first = np.unique(request, return_inverse=True)
        answers, second = np.unique(answer, return_inverse=True)
        keys, which = np.unique(first * len(answers) + second, return_inverse=True)
        order = np.argsort(which.astype(np.uint16), kind="stable")
        cuts = np.searchsorted(which[order], np.arange(1, len(keys)))
        for key, found in zip(keys.tolist(), np.split(order, cuts), strict=True):
            asked = int(requests[key // len(answers)])
            pair = asked >> 32, asked & 0xFFFF_FFFF, int(answers[key % len(answers)])
            writer = self._writers.get(pair)
            if writer is None:
                carries = bool(sends[found[0]])
                valued = carries or bool(kind[found[0]] == _UPLOAD)
                writer = self._writers[pair] = _ValueText(
                    self._bus, pair, self._texts, valued=valued, sends=carries
                )
            written = writer.parts(value[found])
            texts.put(place[found], cells.together(len(found), [*written, lasted[found]]))

    def _write_segments(
        self, dialogue: _Frames, rows: Ints, parts: Sequence[_Part], texts: cells.Texts
    ) -> None:
        """Write the pairs of segmented transfers, which are among those of these rows."""
        kind, answers = dialogue.kind[rows], rows + 1
        segment = kind >= _UPLOADS
        upload = segment & (kind < _DOWNLOADS)
        carrier = np.where(upload, answers, rows)
        lengths = np.where(segment, 7 - (dialogue.word[carrier].astype(np.int64) >> 1 & 7), 0)
        opens = (kind == _OPENS_UPLOAD) | (kind == _OPENS_DOWNLOAD)
        begins, running, count = opens.copy(), list[_Part](), 0
        for part in parts:
            if segment[count]:
                begins[count] = True
                running.append(part)
            count += (part.last - part.first) // 2 + 1
        number, starts, sums = np.cumsum(begins) - 1, np.flatnonzero(begins), np.cumsum(lengths)
        offsets = lengths[starts] - sums[starts]
        sized = dialogue.word[rows[starts] + (kind[starts] == _OPENS_UPLOAD)]
        sizes = (sized >> _HIGH).astype(np.int64)
        sizes[sized & np.uint64(sdo_frame.SIZE_INDICATED) == 0] = 0
        if running:
            goes_on = segment[starts]
            offsets[goes_on] += np.array([part.received for part in running])
            sizes[goes_on] = [part.size for part in running]
        steps = np.flatnonzero(segment)
        sent = lengths[steps]
        ofs = cells.of_few(sizes, lambda size: f" of {size} B" if size else " B")
        have = sums[steps] + offsets[number[steps]]
        for uploads in (True, False):
            chosen = np.flatnonzero(upload[steps] == uploads)
            if not len(chosen):
                continue
            at = rows[steps[chosen]]
            of, head = ofs[number[steps[chosen]]], self._heads.cells(dialogue.node[at])
            so_far = [*cells.whole(have[chosen] - sent[chosen]), of, b" so far"]
            if uploads:
                asked: list[cells.Part] = [head, b"asks for a segment, ", *so_far]
            else:
                asked = [head, b"segment of ", _digit(sent[chosen]), b" B, ", *so_far]
            texts.put(dialogue.place[at], cells.together(len(at), asked))
            open_yet = np.flatnonzero(dialogue.after[at] != 0)
            if len(open_yet):
                said = b"segment, " if uploads else b"segment confirmed, "
                done = [head[open_yet], said, *cells.whole(have[chosen[open_yet]]), of[open_yet]]
                texts.put(dialogue.place[at[open_yet] + 1], cells.together(len(open_yet), done))
        self._write_opened(dialogue, rows[opens], texts)
        ended = np.flatnonzero(segment & (dialogue.after[rows] == 0))
        for end, start in zip(ended.tolist(), starts[number[ended]].tolist(), strict=True):
            row, opened = int(rows[end]), int(rows[start])
            words = dialogue.word[carrier[start + 1 : end + 1]]
            data = _joined(words, lengths[start + 1 : end + 1])
            lasted_us = int(dialogue.at_us[row + 1] - dialogue.at_us[opened])
            text = self._transferred(dialogue, opened, row, data)
            texts.put_one(int(dialogue.place[row + 1]), f"{text}{lasted_us / 1_000:.1f} ms)")

    def _write_blocks(
        self, dialogue: _Frames, blocks: Sequence[tuple[int, int]], texts: cells.Texts
    ) -> None:
        """Write segments of blocks, which are those of these rows."""
        rows = np.concatenate([np.arange(*one) for one in blocks])
        numbers = (dialogue.word[rows] & np.uint64(sdo_frame.BLOCK_SEQNO)).astype(np.int64)
        heads = self._heads.cells(dialogue.node[rows])
        parts = [heads, b"segment ", *cells.whole(numbers), b" of a block"]
        texts.put(dialogue.place[rows], cells.together(len(rows), parts))

    def _write_opened(self, dialogue: _Frames, rows: Ints, texts: cells.Texts) -> None:
        """Write the answers after which segments follow."""
        words, places = dialogue.word, dialogue.place
        parts = dialogue.node[rows], words[rows], words[rows + 1], places[rows + 1]
        for node, request, answer, place in zip(*(one.tolist() for one in parts), strict=True):
            told = "opened", node, request, answer
            if told not in self._texts:
                channel = SdoChannel(node)
                channel.request(0, request.to_bytes(_WHOLE, "little"))
                step = channel.response(0, answer.to_bytes(_WHOLE, "little"))
                self._texts[told] = _text(Decoded("sdo", node, step.text))
            texts.put_one(place, self._texts[told])

    def _transferred(self, dialogue: _Frames, opened: int, last: int, data: bytes) -> str:
        """Return the text of a segmented transfer, without its duration."""
        node = int(dialogue.node[opened])
        pairs = [[dialogue.data(row + n) for n in (0, 1)] for row in (opened, last)]
        key = node, data, *pairs[0]
        if key in self._texts:
            return self._texts[key]
        channel = SdoChannel(node)
        (request, answer), (asks, ends) = pairs
        channel.request(0, request)
        channel.response(0, answer)
        carrier = ends if int(dialogue.kind[last]) < _DOWNLOADS else asks
        rest = 7 - (carrier[0] >> 1 & 7)
        if last > opened + 2:
            channel.take_segments(data[: len(data) - rest], not asks[0] & sdo_frame.TOGGLE)
        channel.request(0, asks)
        said = _ended(self._bus, node, channel.response(0, ends).ended)
        if len(data) <= _SHORT:
            self._texts[key] = said
        return said


class _Talk:
    """Follows the channels through some frames, and finds what is written at once.

    Attributes:
        parts: chains of pairs.
        blocks: segments of blocks, by the rows of the first and behind the last.
    """

    def __init__(self, bus: BusDecoder, dialogue: _Frames, texts: cells.Texts) -> None:
        self._bus, self._dialogue, self._texts = bus, dialogue, texts
        self.parts = list[_Part]()
        self.blocks = list[tuple[int, int]]()

    def follow(self, channel: SdoChannel, row: int, end: int) -> None:
        """Process the frames of a channel, which are those from `row` to before `end`."""
        dialogue = self._dialogue
        while row < end:
            if dialogue.kind[row] and dialogue.before[row] == channel.turn():
                row = self._chain(channel, row)
            elif (direction := channel.block_from()) is not None and (
                dialogue.asks[row] == (direction is TransferDirection.DOWNLOAD)
            ):
                row = self._block(channel, row)
            else:
                self._one(channel, row)
                row += 1

    def _one(self, channel: SdoChannel, row: int) -> None:
        dialogue = self._dialogue
        take = channel.request if dialogue.asks[row] else channel.response
        step = take(int(dialogue.at_us[row]), dialogue.data(row))
        node = channel.node
        text = _text(self._bus.sdo_step(node, step)) if step.ended else f"{node} sdo {step.text}"
        self._texts.put_one(int(dialogue.place[row]), text)

    def _pair(self, channel: SdoChannel, row: int) -> int:
        """Take a pair frame by frame; return the row behind it."""
        self._one(channel, row)
        self._one(channel, row + 1)
        return row + 2

    def _chain(self, channel: SdoChannel, row: int) -> int:
        """Take a chain of pairs; return the row behind it."""
        dialogue, last = self._dialogue, int(self._dialogue.chain[row])
        if dialogue.before[row] != 0:  # within a transfer
            received, size = channel.received()
            done = int(dialogue.done[row])
            ends = done <= last  # else it is a pair of another chain, perhaps of another channel
            last = done - 2 if ends else last
            if last >= row:
                self.parts.append(_Part(row, last, received, size))
                self._segments(channel, row, last)
            return self._pair(channel, done) if ends else last + 2
        self.parts.append(_Part(row, last))
        if dialogue.after[last] == 0:
            channel.end_exchanges()
            return last + 2
        opened = last
        while dialogue.kind[opened] >= _UPLOADS:
            opened -= 2
        if opened > row:
            channel.end_exchanges()
        for place in (opened, opened + 1):
            take = channel.request if dialogue.asks[place] else channel.response
            take(int(dialogue.at_us[place]), dialogue.data(place))
        if last > opened:
            self._segments(channel, opened + 2, last)
        return last + 2

    def _segments(self, channel: SdoChannel, row: int, last: int) -> None:
        """Let a channel take the segments in some pairs."""
        dialogue = self._dialogue
        upload = dialogue.kind[row] < _DOWNLOADS
        words = dialogue.word[row + upload : last + 2 : 2]
        lengths = 7 - (words.astype(np.int64) >> 1 & 7)
        channel.take_segments(_joined(words, lengths), bool(dialogue.kind[last] & 1))

    def _block(self, channel: SdoChannel, row: int) -> int:
        """Take segments of a block; return the row behind them."""
        dialogue, end = self._dialogue, int(self._dialogue.run[row])
        if end <= row:  # an abort, as no segment has number 0
            self._one(channel, row)
            return row + 1
        commands, last = dialogue.word[row:end] & np.uint64(0xFF), None
        lasts = np.flatnonzero(commands & np.uint64(sdo_frame.BLOCK_LAST))
        if len(lasts):
            end = row + int(lasts[0]) + 1
            last = int(commands[end - row - 1]) & sdo_frame.BLOCK_SEQNO
        numbers = (commands[: end - row] & np.uint64(sdo_frame.BLOCK_SEQNO)).astype(np.uint8)
        data = _octets(dialogue.word[row:end]).tobytes()
        channel.take_block(numbers.tobytes(), data, last)
        self.blocks.append((row, end))
        return end


def _octets(words: _Words) -> npt.NDArray[np.uint8]:
    """Return what follows the first byte of each frame."""
    return np.ascontiguousarray(words, "<u8").view(np.uint8).reshape(-1, _WHOLE)[:, 1:]


def _joined(words: _Words, lengths: Ints) -> bytes:
    """Return the data of segments."""
    octets = _octets(words)
    if (lengths == sdo_frame.SEGMENT_BYTES).all():
        return octets.tobytes()
    return octets[np.arange(sdo_frame.SEGMENT_BYTES) < lengths[:, np.newaxis]].tobytes()


def _text(decoded: Decoded) -> str:
    return one_line(decoded_text(decoded))


def _digit(numbers: Ints) -> cells.Cells:
    return (numbers + ord("0")).astype(np.uint8)[:, np.newaxis]


def _durations(spans_us: Ints) -> cells.Cells:
    return cells.of_few(spans_us, lambda span_us: f"{span_us / 1_000:.1f} ms)")


def _ended(bus: BusDecoder, node: int, ended: Sequence[Any]) -> str:
    """Return the text of a transfer, without its duration."""
    (transfer,) = ended
    text = _text(Decoded("sdo", node, None, (), "", None, (bus.named(transfer),)))
    assert text.endswith(_NO_TIME), "it took no time"
    return text.removesuffix(_NO_TIME)


class _ValueText:
    """Writes transfers of two frames that differ in their value alone, without their durations.

    Args:
        bus: decodes the samples.
        pair: node, request, and answer, without the value.
        texts: texts that are kept.
        valued: whether there is a value.
        sends: whether the request has it.
    """

    def __init__(
        self,
        bus: BusDecoder,
        pair: tuple[int, int, int],
        texts: dict[Any, str],
        *,
        valued: bool,
        sends: bool,
    ) -> None:
        self._bus, self._texts, self._sends = bus, texts, sends
        self._node, self._request, self._answer = pair
        self._write: Callable[[Ints], Sequence[cells.Part]] | None = None
        self._head = self._tail = b""
        self._tried = not valued

    def parts(self, values: _Words) -> list[cells.Part]:
        """Return the texts of transfers with these values."""
        if not self._tried and len(values) >= _FEW:
            self._try()
        if self._write is not None:
            return [self._head, *self._write(values.astype(np.int64)), self._tail]
        if len(values) == 1:
            return [cells.encoded(self._text(int(values[0])))]
        found, which = np.unique(values, return_inverse=True)
        return [cells.of_texts(map(self._text, found.tolist()))[which]]

    def _text(self, value: int) -> str:
        key = self._node, self._request, self._answer, value
        if key not in self._texts:
            self._texts[key] = self._decoded(value)
        return self._texts[key]

    def _decoded(self, value: int) -> str:
        channel, pair = SdoChannel(self._node), [self._request, self._answer]
        pair[not self._sends] |= value << 32
        request, answer = (one.to_bytes(_WHOLE, "little") for one in pair)
        channel.request(0, request)
        return _ended(self._bus, self._node, channel.response(0, answer).ended)

    def _try(self) -> None:
        """Find how a value is written; samples decide whether it is right."""
        self._tried = True
        command = (self._request if self._sends else self._answer) & 0xFF
        sized = bool(command & sdo_frame.SIZE_INDICATED)
        size = 4 - (command >> 2 & 3) if sized else 4
        entry = self._request >> 8 & 0xFFFF, self._request >> 24 & 0xFF
        write = _value_writer(self._bus.memory(self._node).describe(*entry), size, sized=sized)
        samples = [0, 1, 0x7F, 0x80, 0xFFFF, 0x8000, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF]
        numbers = np.array([*samples, 0x1234_5678, 0xFEDC_BA98, 0x0001_8000])
        written = cells.joined(len(numbers), [*write(numbers), b"\n"]).split("\n")[:-1]
        expected = [self._decoded(number) for number in numbers.tolist()]
        head, found, tail = expected[0].partition(f" = {written[0]}")
        head = f"{head} = "
        if found and expected == [f"{head}{one}{tail}" for one in written]:
            self._write, self._head, self._tail = write, cells.encoded(head), cells.encoded(tail)


def _value_writer(
    text: ObjectText, size: int, *, sized: bool
) -> Callable[[Ints], Sequence[cells.Part]]:
    """Return what writes values of some bytes, as `ObjectText.read` does."""
    kind, sent = text.kind, size

    def read(value: int) -> str:
        return one_line(
            text.read((value & 0xFFFF_FFFF).to_bytes(4, "little")[:sent], sized=sized)[1]
        )

    if kind is not None and not sized and 0 < kind.size < size:
        size = kind.size
    mask = (1 << 8 * size) - 1
    if kind is None or (text.in_hex and not 0 < kind.size < size):
        return lambda values: [b"0x", cells.hexadecimal(values & mask, size)]
    if not kind.is_integer or kind.bits != 8 * size or text.factor != 1:
        return lambda values: [cells.of_few(values, read)]
    sign = 1 << 8 * size - 1 if kind.signed else 0
    return lambda values: cells.whole((values & mask ^ sign) - sign)

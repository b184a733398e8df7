"""The journal of a running campaign: a line for each verdict, safe from kills and power loss."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final
from zlib import crc32

from tickrig.emulators.testing.campaign.order import CampaignRefusal, RunVerdict
from tickrig.host.text.whole_file import write_whole

_VERSION: Final = 1


class JournalFullError(OSError):
    """The journal cannot be extended; its content is kept."""


class CampaignJournal:
    """File with the verdicts of a campaign, by which an interrupted campaign can continue.

    Each line has a checksum and a JSON array with one verdict. Incomplete lines are ignored, and
    their runs are repeated.

    Args:
        path: path of the file.
        head: properties of the campaign, by name. If the file was written by a campaign with other
            properties, it is refused.

    Attributes:
        verdicts: verdicts read from the file and added later, by number of the run.

    Raises:
        Refusal: the file belongs to another campaign, or to a campaign that is running.
        OSError: the file cannot be read or written.
    """

    def __init__(self, path: Path, head: Mapping[str, Any]) -> None:
        import fcntl  # noqa: PLC0415 - POSIX

        self.path, self.verdicts = path, dict[int, RunVerdict]()
        self._fd = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._fd)
            raise CampaignRefusal(f"{path}: another campaign runs that writes it") from None
        try:
            self._read(head)
        except BaseException:
            os.close(self._fd)
            raise

    def _read(self, head: Mapping[str, Any]) -> None:
        """Load the file, and cut off or rewrite invalid lines."""
        data = self.path.read_bytes()
        entries = list(_entries(data))
        first = entries[0] if entries else None
        if isinstance(first, dict):
            _check_head(self.path, first, head)
            for entry in entries[1:]:
                self._keep(RunVerdict(*entry))
        lines = [_line({"campaign": _VERSION, **head})]
        lines += [_line(list(verdict)) for verdict in self.verdicts.values()]
        # A torn line at the end, or lines of a run that is there twice: written anew, as a
        # whole, beside it.
        if (whole := b"".join(lines)) != data:
            self._rewrite(whole)
        os.lseek(self._fd, 0, os.SEEK_END)

    def _rewrite(self, whole: bytes) -> None:
        """Rewrite the file atomically."""
        import fcntl  # noqa: PLC0415 - POSIX

        write_whole(self.path, whole)
        os.close(self._fd)
        self._fd = os.open(self.path, os.O_RDWR)
        fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _keep(self, verdict: RunVerdict) -> bool:
        """Store a verdict; return False if its run already has one."""
        if verdict.number in self.verdicts:
            return False
        self.verdicts[verdict.number] = verdict
        return True

    def add(self, verdicts: Iterable[RunVerdict]) -> list[RunVerdict]:
        """Write verdicts to the journal file, and return those that were new.

        Raises:
            JournalFullError: some verdicts could not be written. These verdicts are not kept.
        """
        new = [verdict for verdict in verdicts if self._keep(verdict)]
        data = b"".join(_line(list(verdict)) for verdict in new)
        try:
            while data:
                data = data[os.write(self._fd, data) :]
            # One sync a batch: a second of work is what a power loss costs.
            os.fsync(self._fd)
        except OSError as error:
            for verdict in new:
                del self.verdicts[verdict.number]
            raise JournalFullError(error.errno, error.strerror, str(self.path)) from error
        return new

    def close(self) -> None:
        """Unlock and close the file."""
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1

    def remove(self) -> None:
        """Remove the file after writing the table."""
        self.path.unlink(missing_ok=True)
        self.close()


def _line(entry: object) -> bytes:
    text = json.dumps(entry, separators=(",", ":")).encode()
    return b"%08x %b\n" % (crc32(text), text)


def _entries(data: bytes) -> Iterator[Any]:
    """Yield the content of complete lines."""
    for line in data.splitlines(keepends=True):
        check, _, text = line.rstrip(b"\n").partition(b" ")
        if line.endswith(b"\n") and check == b"%08x" % crc32(text):
            yield json.loads(text)


def _check_head(path: Path, found: Mapping[str, Any], head: Mapping[str, Any]) -> None:
    """Refuse the journal of another campaign."""
    if found.get("campaign") != _VERSION:
        raise CampaignRefusal(
            f"{path}: a journal of another version of tickrig; --fresh starts again"
        )
    for name, value in head.items():
        if (before := found.get(name)) != value:
            changed = f"{name} {_short(before)}; now {_short(value)}"
            raise CampaignRefusal(f"{path} is of a campaign with {changed}: --fresh starts again")


def _short(value: object) -> str:
    text = ", ".join(value) if isinstance(value, list) else str(value) or "none"
    return text if len(text) < 80 else f"{text[:77]}..."

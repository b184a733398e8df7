"""The journal of a campaign under way: a line for each verdict, safe from kills and power loss."""

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
SUFFIX: Final = ".journal"


class JournalFullError(OSError):
    """The journal takes no more; what is in it stays."""


class CampaignJournal:
    """Verdicts in a file, each once; a new process goes on where the last one ended.

    A line is a check sum and a JSON array. What is torn, or was never written, is no line, and its
    run is done again.

    Args:
        path: the file.
        head: what the campaign is, by what people call it.

    Attributes:
        verdicts: those of the file, and those that were added, by the number of the run.

    Raises:
        Refusal: the file is of another campaign, or one that runs.
        OSError: it cannot be read or written.
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
        """Take up what the file has; what is no line of it is cut off or written anew."""
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
        """Write the file anew; until that is done, it is as it was."""
        import fcntl  # noqa: PLC0415 - POSIX

        write_whole(self.path, whole)
        os.close(self._fd)
        self._fd = os.open(self.path, os.O_RDWR)
        fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _keep(self, verdict: RunVerdict) -> bool:
        """Note a verdict; False if its run has one."""
        if verdict.number in self.verdicts:
            return False
        self.verdicts[verdict.number] = verdict
        return True

    def add(self, verdicts: Iterable[RunVerdict]) -> list[RunVerdict]:
        """Write verdicts that are not there yet, and return them; they are on the disk then.

        Raises:
            JournalFullError: not all could be written; those that were not are not kept.
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
        """Let others have the file."""
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1

    def remove(self) -> None:
        """Remove the file: the table has all of it."""
        self.path.unlink(missing_ok=True)
        self.close()


def _line(entry: object) -> bytes:
    text = json.dumps(entry, separators=(",", ":")).encode()
    return b"%08x %b\n" % (crc32(text), text)


def _entries(data: bytes) -> Iterator[Any]:
    """Yield what whole lines have."""
    for line in data.splitlines(keepends=True):
        check, _, text = line.rstrip(b"\n").partition(b" ")
        if line.endswith(b"\n") and check == b"%08x" % crc32(text):
            yield json.loads(text)


def _check_head(path: Path, found: Mapping[str, Any], head: Mapping[str, Any]) -> None:
    """Refuse the journal of another campaign."""
    if found.get("campaign") != _VERSION:
        raise CampaignRefusal(
            f"{path}: a journal of another version of tickrig; --fresh begins anew"
        )
    for name, value in head.items():
        if (before := found.get(name)) != value:
            changed = f"{name} {_short(before)}; now {_short(value)}"
            raise CampaignRefusal(f"{path} is of a campaign with {changed}: --fresh begins anew")


def _short(value: object) -> str:
    text = ", ".join(value) if isinstance(value, list) else str(value) or "none"
    return text if len(text) < 80 else f"{text[:77]}..."

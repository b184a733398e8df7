"""The index of a recording: a JSON object a line about its files, gaps, losses and triggers."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from tickrig.host.canmon.model.logs.mark import VERSION, Mark

OPEN: Final = "open"
FILE: Final = "file"
REMOVED: Final = "removed"
END: Final = "end"


class Index:
    """A file to which lines are added, each at once; one that is there is gone on with.

    Args:
        path: of the file.
        is_part: whether a name is that of a part; lines about others are passed over.

    Attributes:
        files: the size of each file that was ended and is still there, the oldest first.
        bytes: size of all of them.
        unended: files that were begun, and neither ended nor removed.

    Raises:
        OSError: it cannot be written, now or later.
    """

    def __init__(self, path: Path, is_part: Callable[[str], object]) -> None:
        self.files: dict[str, int] = {}
        self.bytes, self.unended = 0, list[str]()
        self._path, self._is_part = path, is_part
        text = path.read_text("utf-8", "replace") if path.exists() else ""
        for said in _objects(text):
            self._take(said)
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        if text and not text.endswith("\n"):  # somebody was killed in the middle of a line
            os.write(self._file, b"\n")

    def write(self, event: str, at_us: int, **more: object) -> None:
        """Add a line."""
        said = {"v": VERSION, "ev": event, "t": at_us / 1e6, **more}
        self._take(said)
        self._put(json.dumps(said, separators=(",", ":")))

    def mark(self, mark: Mark, file: str) -> None:
        """Add a mark, and in which file it stands; an empty name for none."""
        text = mark.json()
        self._put(f'{text[:-1]},"file":{json.dumps(file)}}}' if file else text)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def _put(self, text: str) -> None:
        try:
            os.write(self._file, f"{text}\n".encode())
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self._path)) from error

    def _take(self, said: dict[str, Any]) -> None:
        name = said.get("file")
        if not isinstance(name, str) or not self._is_part(name):
            return
        match said.get("ev"):
            case "open":
                self.unended.append(name)
            case "file" | "removed" as event:
                self.unended = [one for one in self.unended if one != name]
                self.bytes -= self.files.pop(name, 0)
                size = said.get("bytes")
                if event == FILE and isinstance(size, int) and size >= 0:
                    self.files[name] = size
                    self.bytes += size


def _objects(text: str) -> Iterator[dict[str, Any]]:
    for line in filter(None, text.splitlines()):
        try:
            said = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(said, dict):
            yield said

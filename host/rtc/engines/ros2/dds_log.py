"""What Cyclone DDS has to say: it would write a line to standard error for each message."""

from __future__ import annotations

import os
import re
import sys
import threading
from pathlib import Path
from typing import Any, Final

from cyclonedds.internal import load_cyclonedds

from tickrig.host.text.log import log_of

FATAL: Final = 1
"""Of the categories of its log (dds/ddsrt/log.h): what it writes to standard error."""

MOST: Final = 100
"""Kinds of lines that are known; of more nothing is said."""

_DESCRIPTORS: Final = "/dev/fd"
_LOG: Final = log_of(__name__)
_NUMBER: Final = re.compile(r"(?<![0-9a-f])(?=[a-f]*+[0-9])[0-9a-f]++")
_HEAD: Final = re.compile(r"^[\d.]+ \[[^]]*\] +\S* *")


class DdsLog:
    """Reads its lines from a pipe until it is closed, and logs each kind once.

    Lines of a kind differ in numbers. What the pipe does not hold is lost: nothing waits.

    Attributes:
        configuration: has DDS write into the pipe; where pipes have no names, it says nothing.
    """

    def __init__(self) -> None:
        reader, self._writer = os.pipe()
        self.configuration = ""
        if sys.platform != "win32" and Path(_DESCRIPTORS).is_dir():
            os.set_blocking(self._writer, False)
            place = f"{_DESCRIPTORS}/{self._writer}"
            self.configuration = (
                f"<Tracing><Category>warning</Category><OutputFile>{place}</OutputFile></Tracing>"
            )
        library: Any = load_cyclonedds()
        library.dds_set_log_mask(FATAL)
        self._thread = threading.Thread(target=_read, args=(reader,), name="ros2 log", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End, once DDS has left the pipe."""
        os.close(self._writer)


def _read(descriptor: int) -> None:
    known = set[str]()
    with open(descriptor, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            text = _HEAD.sub("", line.strip())
            kind = _NUMBER.sub("#", text)
            if kind not in known and len(known) < MOST:
                known.add(kind)
                _LOG.warning("ros2: DDS says: %s", text)

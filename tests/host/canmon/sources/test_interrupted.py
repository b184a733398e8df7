"""Ctrl-C at every step of the wait for frames."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from types import FrameType
from typing import Any

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogTally
from tickrig.host.canmon.sources.live_source import LiveSource
from tickrig.host.links.link import LinkClosed

PATIENCE_S = 10.0


class Silent:
    """A reader of a bus on which nothing comes until it is unplugged."""

    name, lost, stepped = "silent", 0, False

    def __init__(self) -> None:
        self.tally, self.unplugged = LogTally(), SimpleQueue[None]()

    def read(self, timeout_us: int, /) -> list[Record]:
        self.unplugged.get()
        raise LinkClosed("silent: Network is down")

    def close(self) -> None:
        pass


def interrupted_at(step: int, source: LiveSource[Record]) -> bool:
    """Poll, with Ctrl-C at a step; say whether there were so many."""
    left = step

    def tracer(frame: FrameType, event: str, arg: Any) -> Any:
        nonlocal left
        if not frame.f_globals["__name__"].startswith("tickrig."):  # as what the collector calls
            return None
        frame.f_trace_opcodes = True
        left -= 1
        if left == 0:
            raise KeyboardInterrupt
        return tracer

    before = sys.gettrace()
    try:
        sys.settrace(tracer)
        source.poll(1)
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


def test_a_source_can_be_closed_wherever_it_was_interrupted() -> None:
    step, more = 0, True
    while more:
        step += 1
        reader = Silent()
        source: LiveSource[Record] = LiveSource([reader])
        with ThreadPoolExecutor(1) as pool:  # what CPython keeps of the interrupted ends with it
            more = pool.submit(interrupted_at, step, source).result()
        reader.unplugged.put(None)
        closing = threading.Thread(target=source.close, daemon=True)
        closing.start()
        closing.join(PATIENCE_S)
        assert not closing.is_alive(), f"not closed after Ctrl-C at step {step}"
    assert step > 1

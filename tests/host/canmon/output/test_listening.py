"""Blocks that Ctrl-C ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tickrig.host.canmon.output import listening


def test_ctrl_c_before_the_block_ends_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def interrupted(_received: object) -> Iterator[None]:
        yield from ()
        raise KeyboardInterrupt

    monkeypatch.setattr(listening, "taking_signals", interrupted)
    with pytest.raises(KeyboardInterrupt), listening.until_interrupted():
        pytest.fail("the block is entered")


def test_ctrl_c_in_the_block_ends_the_block() -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    with listening.until_interrupted() as interruptions:
        interrupt()
    assert not interruptions.came  # no signal came

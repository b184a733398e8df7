"""Fixtures of the tests of this folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest

from tickrig.host.canmon.conform.conform_source import ConformSource, open_conform_source
from tickrig.host.canmon.net import session
from tickrig.host.links.link import StampedLink
from tickrig.wire.can import CanFrame


@pytest.fixture
def rig(tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """Return the path of the rig file `RIG` of the test module."""
    path = tmp_path / "bench.toml"
    path.write_text(request.module.RIG)
    return str(path)


class _Watched:
    """A link, and the frames that were sent by it."""

    def __init__(self, link: StampedLink) -> None:
        self._link, self.sent = link, list[CanFrame]()

    def __getattr__(self, name: str) -> object:
        return getattr(self._link, name)

    def send(self, frames: tuple[CanFrame, ...]) -> None:
        self.sent += frames
        self._link.send(frames)


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[CanFrame]:
    """Return the frames that a verb sends."""
    frames: list[CanFrame] = []

    def watched(*words: object) -> ConformSource:
        source = open_conform_source(*words)  # type: ignore[arg-type] # passed through
        link = _Watched(source.link)
        link.sent = frames
        return replace(source, link=cast("StampedLink", link))

    monkeypatch.setattr(session, "open_conform_source", watched)
    return frames

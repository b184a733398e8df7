from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served, compile_foreign
from tickrig.host.rtc.engines.openrtm.orb import Orb


@pytest.fixture(scope="session")
def foreign_stubs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with stubs of our IDL for peers."""
    return compile_foreign(tmp_path_factory.mktemp("foreign"))


@pytest.fixture
def system(orb: Orb) -> Iterator[Served]:
    """Return ConsoleIn0 and ConsoleOut0, Active, whose ports peers see."""
    system = Served(orb)
    system.create("ConsoleIn")
    system.create("ConsoleOut")
    try:
        yield system
    finally:
        system.close()


@pytest.fixture
def peer(foreign_stubs: Path) -> Iterator[Peer]:
    """Return a foreign component."""
    peer = Peer(foreign_stubs)
    try:
        yield peer
    finally:
        peer.kill()

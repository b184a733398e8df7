from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.host.rtc.engines.openrtm.name_server import OmniNames
    from tickrig.host.rtc.engines.openrtm.orb import Orb

collect_ignore_glob: list[str] = []
if importlib.util.find_spec("omniORB") is None and not os.environ.get("CI"):
    # these import it; the others are skipped with the reason
    names = ("test_names.py", "test_orb.py", "test_hanging_names.py", "servants", "ports")
    collect_ignore_glob += names


@pytest.fixture
def orb() -> Iterator[Orb]:
    """Return an ORB on a free port of this machine."""
    from tests.host.rtc.engines.openrtm.name_server import free_port  # noqa: PLC0415 - an extra
    from tickrig.host.cli.engine_options import Endpoint  # noqa: PLC0415
    from tickrig.host.rtc.engines.openrtm.orb import Orb  # noqa: PLC0415

    orb = Orb(Endpoint(port=free_port()))
    try:
        yield orb
    finally:
        orb.close()


@pytest.fixture
def omni_names(tmp_path: Path) -> Iterator[OmniNames]:
    """Return a name server that runs."""
    from tests.host.rtc.engines.openrtm.name_server import OmniNames  # noqa: PLC0415 - an extra

    server = OmniNames(tmp_path)
    server.start()
    try:
        yield server
    finally:
        server.kill()

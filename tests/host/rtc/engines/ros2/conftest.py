from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.rtc.engines.ros2.joined import Joined, joined_system

collect_ignore = ["peer.py", "rclpy_node.py"]  # programs of others, which have no tests


@pytest.fixture
def joined(tmp_path: Path) -> Iterator[Joined]:
    """Return a system that can be joined with a domain of its own."""
    with joined_system(tmp_path / "topics.toml") as joined:
        yield joined

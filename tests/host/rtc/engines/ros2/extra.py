"""Skips tests where the extra is not installed."""

from __future__ import annotations

import importlib.util
import os

import pytest

CYCLONE = pytest.mark.skipif(
    importlib.util.find_spec("cyclonedds") is None and not os.environ.get("CI"),
    reason="no Cyclone DDS here: pip install 'tickrig[ros2]'",
)
"""Where CI is set they run, and fail."""

"""Skips tests where the extra is not installed."""

from __future__ import annotations

import importlib.util
import os

import pytest

OMNIORB = pytest.mark.skipif(
    importlib.util.find_spec("omniORB") is None and not os.environ.get("CI"),
    reason="no omniORB here: pip install 'tickrig[openrtm]'",
)
"""Where CI is set they run, and fail."""

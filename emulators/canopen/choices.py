"""What a command line can name; here, so that no device is imported to complete a word."""

from __future__ import annotations

from typing import Final

MODELS: Final = ("f-palette", "motor-core-unit", "epos", "rtc-echo")
"""Names of `models.MODELS`."""

AUTO: Final = "auto"
PROFILES: Final = (AUTO, "none", "401", "402")
"""`AUTO`, and names of `profiles.PROFILES`."""

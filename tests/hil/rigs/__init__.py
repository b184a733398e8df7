"""The rig files of the devices under test."""

from pathlib import Path

RIGS = Path(__file__).parent

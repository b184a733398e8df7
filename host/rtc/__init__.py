"""RT components after OMG RTC 1.0 and OpenRTM-aist 1.x, in one process.

The caller passes the time.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tickrig.host.rtc.model import *  # noqa: F403 - what `__all__` lists there


def __getattr__(name: str) -> object:
    """Return a name of the model. Commands that import this package start without the model."""
    found: object = getattr(import_module(f"{__name__}.model"), name)
    return found

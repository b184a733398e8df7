"""RT components after OMG RTC 1.0 and OpenRTM-aist 1.x, in one process, which is given the time."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tickrig.host.rtc.model import *  # noqa: F403 - what `__all__` lists there


def __getattr__(name: str) -> object:
    """Return a name of the model: the commands here start without it."""
    found: object = getattr(import_module(f"{__name__}.model"), name)
    return found

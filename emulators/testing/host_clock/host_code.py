"""Which code is a host's: that of users and of libraries, not Python, pytest, pyserial or ours."""

from __future__ import annotations

import os
import sysconfig
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Final

# What is raised where a host deals with time as it cannot in virtual time.
#
# RuntimeError
#   HostTimeError         it waits where nobody can make time pass
#     UnpatchedTimeError  it waits for the clock of this machine


class HostTimeError(RuntimeError):
    """A host waits where nobody can make time pass."""


class UnpatchedTimeError(HostTimeError):
    """A host waits for the clock of this machine, or looks at it."""


_KEPT: Final = frozenset(
    {
        *("tickrig", "serial", "can", "canopen"),
        *("pytest", "_pytest", "pluggy", "iniconfig", "xdist", "execnet"),
        *("hypothesis", "coverage", "debugpy", "IPython", "ipykernel"),
    }
)
"""Packages that keep the clock of this machine.

pyserial, python-can and canopen are on a rig by objects of ours (`SimSerial`, the interface
`tickrig`, `SimNetwork`), which wait on it by themselves; on a real port they need real time.
"""

_KEPT_BEGINNINGS: Final = ("pytest_", "pydev", "_pydev")

_INSTALLED: Final = tuple(f"{os.sep}{name}{os.sep}" for name in ("site-packages", "dist-packages"))
_PYTHON: Final = tuple(f"{sysconfig.get_path(name)}{os.sep}" for name in ("stdlib", "platstdlib"))


@cache
def is_host(module: str, file: str) -> bool:
    """Return whether code is a host's.

    Args:
        module: name of its module.
        file: where it is, as its code object says.

    >>> is_host("my_robot.link", "/home/me/my_robot/link.py"), is_host("queue", "<frozen queue>")
    (True, False)
    """
    package = module.partition(".")[0]
    if package in _KEPT or package.startswith(_KEPT_BEGINNINGS) or file.startswith("<frozen"):
        return False
    return is_installed(file) or not file.startswith(_PYTHON)


@cache
def is_installed(file: str) -> bool:
    """Return whether a file is of an installed package."""
    return any(folder in file for folder in _INSTALLED)


def package_of(frame: FrameType) -> str:
    """Return the name of the package that is running."""
    name: str = frame.f_globals.get("__name__") or ""
    return name.partition(".")[0]


def line_of(frame: FrameType) -> str:
    """Return the file and line that are running, for people."""
    return place_of(frame.f_code.co_filename, frame.f_lineno)


def place_of(file: str, line: int) -> str:
    """Return a file and line for people."""
    path = Path(file)
    return f"{path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path}:{line}"

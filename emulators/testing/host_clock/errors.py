"""What is raised where a host deals with time as it cannot in virtual time.

RuntimeError
  HostTimeError         it waits where nobody can make time pass
    UnpatchedTimeError  it waits for the clock of this machine
"""

from __future__ import annotations


class HostTimeError(RuntimeError):
    """A host waits where nobody can make time pass."""


class UnpatchedTimeError(HostTimeError):
    """A host waits for the clock of this machine, or looks at it."""

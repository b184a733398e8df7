"""What a bench cannot do, and when it cannot judge.

BenchError
NotOnThisBench        this mode cannot do that; the plug-in skips the test
BenchBlocked          no verdict about the device; the plug-in reports an error
MachineTooSlow    real time was not kept
PortGone          a port, a bus or an emulator's socket is there no more
OperatorRefused   a human at the terminal did not do what was asked
"""

from __future__ import annotations


class BenchError(Exception):
    """A bench that cannot do what a test asks of it."""


class NotOnThisBench(BenchError):  # noqa: N818 - no error of the test
    """What the mode of this bench cannot do; the text says why."""


class BenchBlocked(BenchError):  # noqa: N818 - no error of the device
    """A test that came to no verdict, and not because of the device."""


class MachineTooSlow(BenchBlocked):
    """Real time was not kept: what the device did late says nothing about it."""


class PortGone(BenchBlocked):
    """A port, a bus or an emulator's control socket is there no more."""


class OperatorRefused(BenchBlocked):
    """A human at the terminal did not do what was asked."""

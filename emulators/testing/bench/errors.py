"""Errors of a bench: unsupported operations, and tests without a verdict.

`BenchError` is the base class.

- `NotOnThisBench`: this mode cannot do the operation. The plug-in skips the test.
- `BenchBlocked`: there is no verdict about the device. The plug-in reports an error. The next three
  classes are subclasses.
- `MachineTooSlow`: real time was not kept.
- `PortGone`: a port, a bus or an emulator's socket is gone.
- `OperatorRefused`: a human at the terminal did not execute a request.
"""

from __future__ import annotations


class BenchError(Exception):
    """A bench cannot do the operation that a test needs."""

    __module__ = "tickrig"


class NotOnThisBench(BenchError):  # noqa: N818 - no error of the test
    """Raised if the mode of the bench does not support an operation; the message has the reason."""

    __module__ = "tickrig"


class BenchBlocked(BenchError):  # noqa: N818 - no error of the device
    """A test comes to no verdict, for a reason outside the device."""

    __module__ = "tickrig"


class MachineTooSlow(BenchBlocked):
    """Raised if the machine was too slow to keep real time.

    In this case a delay in the test may come from the machine instead of the device. Therefore the
    test has no verdict.
    """

    __module__ = "tickrig"


class PortGone(BenchBlocked):
    """A port, a bus or an emulator's control socket is gone."""

    __module__ = "tickrig"


class OperatorRefused(BenchBlocked):
    """A human at the terminal did not execute a request."""

    __module__ = "tickrig"

"""Errors of a bench: unsupported operations, and tests without a verdict.

`BenchError` is the base class.

- `NotOnThisBench`: this mode cannot do that; the plug-in skips the test.
- `BenchBlocked`: no verdict about the device; the plug-in reports an error. Its subclasses are the
  next three.
- `MachineTooSlow`: real time was not kept.
- `PortGone`: a port, a bus or an emulator's socket is gone.
- `OperatorRefused`: a human at the terminal did not execute a request.
"""

from __future__ import annotations


class BenchError(Exception):
    """A bench that cannot do what a test asks of it."""


class NotOnThisBench(BenchError):  # noqa: N818 - no error of the test
    """The mode of this bench does not support this; the message has the reason."""


class BenchBlocked(BenchError):  # noqa: N818 - no error of the device
    """A test without a verdict, for a reason outside the device."""


class MachineTooSlow(BenchBlocked):
    """Real time was not kept: delays of the device may come from the machine."""


class PortGone(BenchBlocked):
    """A port, a bus or an emulator's control socket is gone."""


class OperatorRefused(BenchBlocked):
    """A human at the terminal did not execute a request."""

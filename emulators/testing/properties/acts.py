"""What is done before each session, looked at before it is done."""

from __future__ import annotations

from typing import Any, Final

from tickrig.emulators.testing.properties.strategies import Session
from tickrig.host.text.names import near
from tickrig.wire.can import CanFrame

VERBS: Final = ("send", "set", "reset")


def check_start(start: Session, device: Any, nothing: Any) -> None:
    """Look whether each act of `start` can be done.

    Args:
        start: the acts.
        device: one of its kind; it is looked at only.
        nothing: traffic without anything in it.

    Raises:
        ValueError: one cannot; the text says which, and why.
    """
    for number, act in enumerate(start):
        try:
            _check(act, device, nothing)
        except ValueError as error:
            raise ValueError(f"start[{number}]: {error}") from None


def _check(act: Any, device: Any, nothing: Any) -> None:
    if not isinstance(act, tuple) or len(act) != 3:
        raise ValueError(f"an act is (wait in us, verb, what), got {act!r}")
    wait_us, verb, what = act
    if type(wait_us) is not int or wait_us < 0:
        raise ValueError(f"the wait is in whole microseconds, got {wait_us!r}")
    if verb not in VERBS:
        raise ValueError(f"no act {verb!r}; {near(str(verb), VERBS)} (send, set, reset)")
    if verb == "reset":
        if what is not None:
            raise ValueError(f"reset takes None, got {what!r}")
    elif verb == "send":
        _check_traffic(what, nothing)
    elif not isinstance(what, tuple) or len(what) != 2:
        raise ValueError(f"set takes (name, value), got {what!r}")
    elif not hasattr(device, "inputs"):
        raise ValueError(f"{type(device).__name__} has no inputs to set")
    else:
        device.inputs.check(*what)


def _check_traffic(what: Any, nothing: Any) -> None:
    if type(what) is not type(nothing):
        wanted = "bytes" if nothing == b"" else "a tuple of CanFrame"
        raise ValueError(f"send takes {wanted}, got {what!r}")
    if nothing != b"" and not all(isinstance(frame, CanFrame) for frame in what):
        raise ValueError(f"send takes a tuple of CanFrame, got {what!r}")

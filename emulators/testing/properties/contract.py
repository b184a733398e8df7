"""The attributes of a device and their types; an error names the class in one line."""

from __future__ import annotations

from typing import Any, Final

from tickrig.emulators.testing.properties.strategies import Act

_MEMBERS: Final = {
    "tick_us": "its control period in us",
    "due_us": "the earliest time at which it does something unasked, or NEVER",
    "tick": "tick(now_us, rx) returns what it sends",
    "reset": "reset() is power-on",
}
"""Attributes of a device on any wire."""

_SIGNALS: Final = {
    "inputs": "an InputBank, InputBank(()) if there are none",
    "outputs": "a dict of OutputSignal by name, {} if there are none",
}
"""Further attributes of a device on a serial line; the application of a node has them."""


def must(holds: bool, text: str) -> None:
    """Raise AssertionError with only a text, unless `holds` is true."""
    if not holds:
        raise AssertionError(text)


def check_members(device: Any, nothing: Any) -> None:
    """Check that an object has the attributes that every device must have, and a valid period.

    Args:
        device: the device, which is not changed.
        nothing: value that the device receives in a tick without traffic: empty bytes, or an empty
            tuple of frames.

    Raises:
        AssertionError: an attribute is missing, or the period is invalid.
    """
    kind = type(device).__name__
    for name, text in (_MEMBERS | _SIGNALS if nothing == b"" else _MEMBERS).items():
        must(hasattr(device, name), f"{kind} has no {name}: {text}")
    check_period(device)


def check_period(device: Any) -> None:
    """Raise AssertionError unless `tick_us` is a period and `due_us` is a time."""
    tick_us, kind = device.tick_us, type(device).__name__
    good = type(tick_us) is int and tick_us > 0
    must(good, f"{kind}.tick_us is {tick_us!r}: whole microseconds above 0")
    _check_due(device)


def _check_due(device: Any) -> None:
    """Raise AssertionError unless `due_us` is a time."""
    due_us, kind = device.due_us, type(device).__name__
    must(type(due_us) is int, f"{kind}.due_us is {due_us!r}: whole microseconds, or NEVER")


def check_acts(device: Any, acts: list[Act], nothing: Any) -> None:
    """Execute actions on a device, and check the types of all values that the device returns.

    The ticks of the device are called directly, without a rig and without a wire.

    Args:
        device: a new device.
        acts: actions of host and environment.
        nothing: value that the device receives in a tick without traffic: empty bytes, or an empty
            tuple of frames.

    Raises:
        AssertionError: a value has a wrong type, or a tick has not cleared `inputs.changed`.
    """
    now_us = device.tick_us
    for wait_us, verb, what in acts:
        if verb == "reset":
            device.reset()
        elif verb == "set":
            device.inputs.set(*what)
        for rx in (what if verb == "send" else nothing, nothing):
            _tick(device, now_us, rx, nothing)
            now_us += device.tick_us
        now_us += wait_us - wait_us % device.tick_us


def _tick(device: Any, now_us: int, rx: Any, nothing: Any) -> None:
    kind, wanted = type(device).__name__, type(nothing)
    sent = device.tick(now_us, rx)
    told = f"{kind}.tick returned {_said(sent)}: it returns {wanted.__name__}, {nothing!r} for none"
    must(isinstance(sent, wanted), told)
    _check_due(device)
    if nothing == b"":
        told = f"{kind}.tick leaves inputs.changed set: it is cleared in each tick"
        must(not device.inputs.changed, told)
    for name in getattr(device, "outputs", ()):
        value = device.read(name)
        told = f"{kind}.read({name!r}) returned {_said(value)}: a number or a text"
        must(isinstance(value, int | float | str), told)


def _said(value: Any) -> str:
    return "None" if value is None else type(value).__name__

"""One call that tests what every device must guarantee."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky

from tickrig.device.core import Device
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DEVICES, DeviceType
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties import strategies
from tickrig.emulators.testing.properties.checks import DeviceChecks
from tickrig.emulators.testing.properties.contract import check_members
from tickrig.emulators.testing.properties.device_bench import (
    NOTHING,
    DeviceBench,
    TicksDifferError,
    explain_ticks,
    shortened,
)
from tickrig.emulators.testing.properties.strategies import Session
from tickrig.host.text.names import near
from tickrig.wire.can import CanFrame

# What is done before each session, looked at before it is done.

_VERBS: Final = ("send", "set", "reset")


def _check_start(start: Session, device: Any, nothing: Any) -> None:
    """Check that each act of `start` can be executed.

    Args:
        start: acts that start the device.
        device: a device of the same type, which is not changed.
        nothing: empty traffic.

    Raises:
        ValueError: an act cannot be executed. The message has the act and the reason.
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
    if verb not in _VERBS:
        raise ValueError(f"no act {verb!r}; {near(str(verb), _VERBS)} (send, set, reset)")
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


# The search for a session in which a device does something wrong; once found, it ends soon.

_SLOW: Final = (HealthCheck.too_slow, HealthCheck.data_too_large)

_TRIES: Final = 200
"""Number of attempts to shorten a failing session."""


def _search(
    check: Callable[..., None],
    drawn: st.SearchStrategy[Session],
    names: tuple[str, ...],
    max_examples: int,
) -> None:
    """Draw sessions until a check raises, then search for shorter sessions that fail.

    Args:
        check: function that takes sessions by name.
        drawn: the strategies of the sessions.
        names: the names of the sessions.
        max_examples: number of sessions of each name, if no check raises.

    Raises:
        Exception: the exception of the check for the shortest session. A note lists the acts of the
            session.
    """
    found: dict[str, Exception] = {}
    met: dict[str, dict[str, Session]] = {}
    tries = [_TRIES]

    @settings(
        max_examples=max_examples,
        deadline=None,
        suppress_health_check=_SLOW,
        report_multiple_bugs=False,
        print_blob=False,
        phases=[phase for phase in settings().phases if phase is not Phase.explain],
    )
    @given(**dict.fromkeys(names, drawn))
    def it_meets(**sessions: Session) -> None:
        key = repr(sessions)
        if known := found.get(key):
            raise known
        tries[0] -= bool(found)
        if tries[0] < 0:
            return  # whatever else is tried is taken for right: what was found stays the shortest
        try:
            check(**sessions)
        except Exception as error:
            found[key], met[key] = error, sessions
            raise

    try:
        it_meets()
    except Flaky:  # chance: it was so once
        raise min(found.items(), key=lambda each: len(each[0]))[1] from None
    except Exception as error:
        key = next((key for key, one in found.items() if one is error), "")
        if not key:
            raise  # a strategy has raised it
        raise _shortest(check, met[key], error) from None


def _shortest(
    check: Callable[..., None], sessions: Mapping[str, Session], error: Exception
) -> Exception:
    """Remove acts without which a check raises the same error; return the exception of the rest."""
    shortest, needed = error, dict(sessions)
    for name in sessions:

        def fails(fewer: list[Any], name: str = name) -> bool:
            nonlocal shortest
            try:
                check(**{**needed, name: fewer})
            except Exception as again:
                if type(again) is type(error) and _kind(again) == _kind(error):
                    shortest = again
                    return True
            return False

        needed[name] = shortened(needed[name], fails)
    words = [f"{name}={session!r}" for name, session in needed.items()]
    shortest.add_note("no act can be left out: " + ", ".join(words))
    return shortest


def _kind(error: Exception) -> str:
    """Return the text of an error up to its first number, which another session may change."""
    return re.split(r"[0-9]", str(error.args[0] if error.args else ""), maxsplit=1)[0]


WireMaker = Callable[[], ByteLine | CanWire]


def check_device(  # noqa: PLR0913 - by name
    device_type: DeviceType | str | Callable[[], Device[Any]],
    *,
    traffic: st.SearchStrategy[Any] | None = None,
    wire: WireMaker | None = None,
    start: Session = NOTHING,
    max_examples: int = 30,
    remembers: bool = False,
    pauses: bool = True,
) -> None:
    r"""Test a device type in random sessions of bytes or frames, inputs, resets and pauses.

    - The device has the attributes of a device, and returns values of the right types. `tick`
      clears `inputs.changed`.
    - The device does not raise an exception for any traffic or input.
    - A new device with the same traffic behaves identically. On a serial line, a device replayed
      from the trace behaves identically, too.
    - Ticks at which the device is not due change nothing (dense = sparse), up to a day later.
    - A host that writes in pieces gets the same answers as a host that writes at once. The device
      gives the same answer to a word of `strategies.chunks` that arrives in two ticks as to a word
      that arrives in one tick.
    - A reset device equals a new device with the same inputs.
    - A copy behaves like the original, whether made by `copy.deepcopy`, by pickle or with its rig.
      Changes to the copy do not change the original. A device that a snapshot restores continues
      from that state.

    Args:
        device_type: factory of the device: a `DeviceType` or its name, a class or a function.
        traffic: strategy for the traffic that a host sends at once: `strategies.chunks(...)` or
            `strategies.frames(...)`. The default is noise.
        wire: factory of the wire, such as `CanWire`. The default is the wire of the device type, or
            a serial line.
        start: acts that start the device, executed in order before each session. `(5_000, "send",
            b"ON\n")` sends after 5 ms, `(0, "set", ("jam", 1))` sets an input, and `(0, "reset",
            None)` resets the device.
        max_examples: number of sessions for each test.
        remembers: whether a reset keeps more than configuration and inputs, for example stored
            parameters or the position of an axis.
        pauses: whether pauses within a word have no effect. The value is False if a pause ends a
            frame, as in Modbus RTU.

    Raises:
        AssertionError: a property of the list above does not hold. The message has the time and the
            difference, and a note has the shortest session found.
        ValueError: an act of `start` cannot be executed, or no device type has the given name.

    >>> check_device("rrc", traffic=strategies.chunks([b"hello\n", b"device\n"]), max_examples=2)
    """
    make, wire = _parts(device_type, wire)
    on_can = isinstance(wire(), CanWire)
    nothing: Any = () if on_can else b""
    device = make()
    check_members(device, nothing)
    _check_start(start, device, nothing)
    if traffic is None:
        traffic = strategies.frames() if on_can else strategies.chunks()
    bench = partial(DeviceBench, make=make, wire=wire, start=start)
    find = partial(_search, drawn=strategies.sessions(device, traffic), max_examples=max_examples)
    checks = DeviceChecks(bench, remembers, pauses)
    try:
        find(checks.check_ticks, names=("session",))
    except TicksDifferError as error:
        text, session = error.args
        error.args = (explain_ticks(bench, start, session) or text,)
        raise
    find(checks.check_reset, names=("session", "after"))
    find(checks.check_replay, names=("session",))
    find(checks.check_copies, names=("session", "after", "otherwise"))


def _parts(
    device_type: DeviceType | str | Callable[[], Any], wire: WireMaker | None
) -> tuple[Callable[[], Any], WireMaker]:
    """Return the factory of the device, and the factory of its wire."""
    made = DEVICES.load(device_type) if isinstance(device_type, str) else device_type
    if isinstance(made, DeviceType):
        return partial(made.build, {}), wire or partial(made.line.wire, made.line.baud)
    if not callable(made):
        raise ValueError(f"a device type, its name, a class or a function, got {made!r:.60}")
    return made, wire or SerialLine

"""A device that breaks a rule is found by `check_device`, and one that keeps them all is not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import count

import pytest
from hypothesis import Phase, settings

from tests.emulators import echo
from tests.emulators.lamp import Lamp
from tickrig.device.physical import InputBank, OutputSignal
from tickrig.device.twin import NonCopyable
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DeviceType
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.testing import check_device, strategies
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER


class Echo(echo.Echo):
    """Has what a device on a line has."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.inputs, self.outputs = InputBank(), dict[str, OutputSignal]()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        return super().tick(now_us, rx)


class Impatient(Echo):
    """Counts the ticks, and says it."""

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.number = getattr(self, "number", 0) + 1
        return super().tick(now_us, rx) + (b"%d" % self.number if rx else b"")


class Picky(Echo):
    """Takes no byte above 7Fh."""

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        return super().tick(now_us, rx.decode("ascii").encode())


class Toggling(Echo):
    """Says after a reset whether their number is odd."""

    odd = False

    def reset(self) -> None:
        self.odd = not self.odd

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        return super().tick(now_us, rx) + (b"odd" if self.odd and b"n" in rx else b"")


MADE = count()


class Numbered(Echo):
    """No two of them are the same."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.serial = next(MADE)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        return super().tick(now_us, rx) + (b"%d" % self.serial if rx else b"")


SHARED: list[bytes] = []


class Communist(Echo):
    """What one of them hears, all of them say; a new one begins anew."""

    def __post_init__(self) -> None:
        super().__post_init__()
        SHARED.clear()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        SHARED.extend([rx] if rx else [])
        return super().tick(now_us, rx) + (b"%d" % len(SHARED) if rx else b"")


class Closed(Echo):
    """Keeps a closure."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.later = lambda: self.heard


class Bound(Echo, NonCopyable):
    """Cannot be copied."""


class CanEcho:
    """Repeats each frame under the next identifier; odd ones are refused badly, if it does so."""

    tick_us = 1_000
    due_us = NEVER

    def __init__(self, refuses: bool = False) -> None:
        self.refuses = refuses

    def reset(self) -> None:
        return

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        if self.refuses and any(frame.can_id & 1 for frame in rx):
            raise ValueError("odd")
        return tuple(CanFrame(frame.can_id ^ 0x400, frame.data) for frame in rx)


@pytest.fixture(autouse=True)
def unshrunk() -> Iterator[None]:
    """What is found need not be the shortest session."""
    settings.register_profile("unshrunk", settings(), phases=[Phase.generate], database=None)
    settings.load_profile("unshrunk")
    yield
    settings.load_profile("tickrig")


SPEAKS = strategies.chunks([b"on", b"off"])


@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        (Impatient, AssertionError, "dense and sparse ticks differ|a tick that is not due changes"),
        (Picky, UnicodeDecodeError, "ascii"),
        (Toggling, AssertionError, "reset keeps something|a second reset makes"),
        (Numbered, AssertionError, "two fresh devices that met the same differ"),
        (Communist, AssertionError, "two fresh devices that met the same differ"),
        (Closed, TypeError, "<lambda>"),
        (Bound, TypeError, "Bound cannot be copied"),
    ],
)
def test_a_device_that_breaks_a_rule_is_found(
    bad: Callable[[], Echo], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        check_device(bad, traffic=SPEAKS)


class Fragile(Echo):
    """Raises if it hears b"on" after b"off", whatever else it hears."""

    def reset(self) -> None:
        super().reset()
        self.off = False

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        if b"on" in rx and getattr(self, "off", False):
            raise LookupError("it breaks")
        self.off = getattr(self, "off", False) or b"off" in rx
        return super().tick(now_us, rx)


def test_no_act_of_what_is_found_can_be_left_out() -> None:
    with pytest.raises(LookupError, match="it breaks") as caught:
        check_device(Fragile, traffic=SPEAKS)
    (note,) = [note for note in caught.value.__notes__ if note.startswith("no act can be left out")]
    assert note.count("'send'") <= 2
    assert "'set'" not in note


def test_frames_are_noise_too() -> None:
    with pytest.raises(ValueError, match="odd"):
        check_device(partial(CanEcho, refuses=True), wire=CanWire)


@pytest.mark.parametrize(
    "check",
    [
        partial(check_device, Echo),
        partial(
            check_device,
            partial(Echo, 1_000, 7_000),
            wire=partial(Rs485Line, 9_600),
            remembers=True,
        ),
        partial(check_device, Lamp, traffic=SPEAKS, start=[(5_000, "send", b"on")]),
        partial(check_device, DeviceType(name="lamp", title="a lamp", build=lambda config: Lamp())),
        partial(check_device, CanEcho, wire=CanWire, traffic=strategies.frames(["123#01"], [5])),
    ],
)
def test_a_device_that_keeps_the_rules_passes(check: Callable[..., None]) -> None:
    check(max_examples=5)

"""What error frames say about a bus and about our own controller."""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.wire.can_error import (
    CONTROLLER_BYTE,
    REC_BYTE,
    TEC_BYTE,
    ControllerFlag,
    ErrorClass,
    ErrorFrame,
    ErrorState,
    describe_error_frame,
)

OVERFLOW: Final = ControllerFlag.RECEIVE_OVERFLOW
PASSIVE: Final = ControllerFlag.RECEIVE_PASSIVE | ControllerFlag.TRANSMIT_PASSIVE


class ErrorRow(NamedTuple):
    """What the error frames of a bus were.

    Attributes:
        frames: how many.
        state: of our controller as the latest of them says; None if none says it.
        tec: its transmit error counter, None if never told.
        rec: its receive error counter, None if never told.
        overflows: how often its receive buffer ran over: frames were lost.
        kinds: what they said and how often, the most frequent first.
    """

    frames: int = 0
    state: ErrorState | None = None
    tec: int | None = None
    rec: int | None = None
    overflows: int = 0
    kinds: tuple[tuple[str, int], ...] = ()


class ErrorStatistics:
    """Follows the error frames of a bus."""

    __slots__ = ("_frames", "_kinds", "_overflows", "_rec", "_state", "_tec")

    def __init__(self) -> None:
        self._frames = self._overflows = 0
        self._state: ErrorState | None = None
        self._tec: int | None = None
        self._rec: int | None = None
        self._kinds: dict[str, int] = {}

    def take(self, frame: ErrorFrame) -> None:
        """Count an error frame."""
        self._frames += 1
        kind = describe_error_frame(frame)
        self._kinds[kind] = self._kinds.get(kind, 0) + 1
        state = state_after(frame)
        self._state = self._state if state is None else state
        if frame.error_class & ErrorClass.COUNTERS:
            self._tec, self._rec = frame.data[TEC_BYTE], frame.data[REC_BYTE]
        if is_overflow(frame):
            self._overflows += 1

    def row(self) -> ErrorRow:
        """Return what they were."""
        kinds = sorted(self._kinds.items(), key=lambda item: (-item[1], item[0]))
        return ErrorRow(
            self._frames, self._state, self._tec, self._rec, self._overflows, tuple(kinds)
        )


def is_overflow(frame: ErrorFrame) -> bool:
    """Say whether our controller lost frames."""
    return bool(
        frame.error_class & ErrorClass.CONTROLLER and frame.data[CONTROLLER_BYTE] & OVERFLOW
    )


def state_after(frame: ErrorFrame) -> ErrorState | None:
    """Return the state of our controller after an error frame; None if it does not say."""
    if frame.error_class & ErrorClass.BUS_OFF:
        return ErrorState.BUS_OFF
    flags = frame.data[CONTROLLER_BYTE] if frame.error_class & ErrorClass.CONTROLLER else 0
    if flags & PASSIVE:
        return ErrorState.PASSIVE
    if flags & ControllerFlag.ACTIVE or frame.error_class & ErrorClass.RESTARTED:
        return ErrorState.ACTIVE
    return None

"""Requests to an emulator from another thread, served between its steps."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from queue import Empty, SimpleQueue

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.host.control.requests import Object

Answers = Future[list[Object]]


class EmulatorEnded(Exception):  # noqa: N818 - no error
    """Nobody is there to answer any more."""


class Inbox:
    """Takes requests from any thread; the emulator's own thread answers them.

    Args:
        control: answers the requests, as those of the control socket.
    """

    def __init__(self, control: EmulatorControl) -> None:
        self._control = control
        self._posted: SimpleQueue[tuple[Sequence[Object], Answers]] = SimpleQueue()
        self._closed = False

    def post(self, requests: Sequence[Object]) -> Answers:
        """Hand in requests; they are answered together, between two steps.

        The future raises EmulatorEnded if the emulator ends first. It is not cancelled: an event
        loop would take that for the end of the task that waits.
        """
        answers: Answers = Future()
        self._posted.put((requests, answers))
        if self._closed:
            self.serve()
        return answers

    def serve(self) -> None:
        """Answer what was handed in, or refuse it after the end."""
        while True:
            try:
                requests, answers = self._posted.get_nowait()
            except Empty:
                return
            if not answers.set_running_or_notify_cancel():
                continue
            if self._closed:
                answers.set_exception(EmulatorEnded())
            else:
                answers.set_result([self._control.answer(request) for request in requests])

    def close(self) -> None:
        """Answer nothing any more."""
        self._closed = True
        self.serve()

"""Requests to an emulator from another thread, served between its steps."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from queue import Empty, SimpleQueue

from tickrig.emulators.control import Control
from tickrig.emulators.requests import Object

Answers = Future[list[Object]]


class Inbox:
    """Takes requests from any thread; the emulator's own thread answers them.

    Args:
        control: answers the requests, as those of the control socket.
    """

    def __init__(self, control: Control) -> None:
        self._control = control
        self._posted: SimpleQueue[tuple[Sequence[Object], Answers]] = SimpleQueue()
        self._closed = False

    def post(self, requests: Sequence[Object]) -> Answers:
        """Hand in requests; they are answered together, between two steps.

        The future is cancelled if the emulator ends first.
        """
        answers: Answers = Future()
        self._posted.put((requests, answers))
        if self._closed:
            self.serve()
        return answers

    def serve(self) -> None:
        """Answer what was handed in, or cancel it after the end."""
        while True:
            try:
                requests, answers = self._posted.get_nowait()
            except Empty:
                return
            if self._closed:
                answers.cancel()
            elif answers.set_running_or_notify_cancel():
                answers.set_result([self._control.answer(request) for request in requests])

    def close(self) -> None:
        """Answer nothing any more."""
        self._closed = True
        self.serve()

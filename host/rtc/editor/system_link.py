"""A link to the control socket of a running system.

A thread asks while a screen shows the system.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from tickrig.host.control.client import ControlClient, ControlRefused
from tickrig.host.control.requests import Object

_PERIOD_S: Final = 0.2
"""Interval at which the system is described again."""


@dataclass(frozen=True, slots=True)
class _Answer:
    """The result of a request.

    Attributes:
        text: text for the user, which may be empty.
        refused: whether the request was refused.
    """

    text: str
    refused: bool = False


class SystemLink:
    """Link of the editor to a running system.

    The link has its own thread, which reads the state of the system and sends requests to the
    system. The link connects again if the connection breaks, because the system may be restarted or
    replaced.

    Args:
        socket: control socket of the system.

    Attributes:
        components: latest descriptions of the components.
        problem: reason why the state is unknown, empty while the system answers.
    """

    def __init__(self, socket: Path) -> None:
        self._socket = socket
        self.components: list[Any] = []
        self.problem = ""
        self._answers = deque[_Answer]()
        self._requests: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._client: ControlClient | None = None
        self._thread = threading.Thread(target=self._run, name="system", daemon=True)

    def request(
        self, do: str, then: Callable[[Object], str] | None = None, **fields: object
    ) -> None:
        """Queue a request to the system. `take_answers` returns the result of the request later.

        Args:
            do: name of the request, such as `activate`.
            then: function that the link's thread calls with the answer, and that returns the text
                to show to the user.
            fields: further fields of the request.
        """
        self._requests.put(partial(self._make, do, fields, then or (lambda answer: "")))

    def take_answers(self) -> list[_Answer]:
        """Return the results of requests since the last call."""
        taken = list[_Answer]()
        while self._answers:
            taken.append(self._answers.popleft())
        return taken

    def turn(self) -> None:
        """Send all queued requests, and read the state of the system once.

        The thread of the link calls this method repeatedly.
        """
        while not self._requests.empty():
            if (request := self._requests.get()) is None:
                self._requests.put(None)  # `_run` ends at it
                break
            request()
        answer = self._request("describe")
        if isinstance(answer, str):
            self.problem = answer
        elif isinstance(components := answer.get("components"), list):
            self.components, self.problem = components, ""

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Stop the thread without waiting for a running request."""
        self._requests.put(None)

    def _run(self) -> None:
        while True:
            self.turn()
            try:
                request = self._requests.get(timeout=_PERIOD_S)
            except queue.Empty:
                continue
            if request is None:
                self._hang_up()
                return
            request()

    def _make(self, do: str, fields: Object, then: Callable[[Object], str]) -> None:
        answer = self._request(do, **fields)
        if isinstance(answer, str):
            self._answers.append(_Answer(answer, refused=True))
            return
        try:
            text = then(answer)
        except (OSError, ValueError) as error:
            self._answers.append(_Answer(str(error), refused=True))
        else:
            self._answers.append(_Answer(text))

    def _request(self, do: str, **fields: object) -> Object | str:
        """Return the answer, or the reason why there is none."""
        try:
            if self._client is None:
                self._client = ControlClient(self._socket)
            return self._client.request(do, **fields)
        except ControlRefused as error:
            return str(error)
        except TimeoutError:
            why = "the system does not answer"
        except OSError as error:
            why = str(error.strerror or error)
        except ValueError as error:
            why = str(error)
        self._hang_up()
        return f"socket {self._socket}: {why}"

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

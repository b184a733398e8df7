"""Lists of functions that are called when something happens. No function can stop the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final, ParamSpec

from tickrig.host.text.log import log_of

P = ParamSpec("P")

_LOG: Final = log_of(__name__)


def call_listeners(
    who: str, listeners: Iterable[Callable[P, object]], *args: P.args, **kwargs: P.kwargs
) -> None:
    """Call each function of a list of listeners. An exception in a listener is only logged.

    Args:
        who: owner of the listeners, for the log.
        listeners: functions that are called in their order. A listener may add or remove listeners.
        args: positional arguments of each call.
        kwargs: keyword arguments of each call.
    """
    for listener in tuple(listeners):
        try:
            listener(*args, **kwargs)
        except Exception:  # as callbacks of a component: one must not end the others
            _LOG.exception("%s: a listener raised", who)

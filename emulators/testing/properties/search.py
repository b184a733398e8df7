"""The search for a session in which a device does something wrong; once found, it ends soon."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky

from tickrig.emulators.testing.properties.strategies import Session

SLOW: Final = (HealthCheck.too_slow, HealthCheck.data_too_large)

TRIES: Final = 200
"""So often something shorter is looked for, once something was found."""


def search(
    check: Callable[..., None],
    drawn: st.SearchStrategy[Session],
    names: tuple[str, ...],
    max_examples: int,
) -> None:
    """Draw sessions until a check raises, then shorter ones.

    Args:
        check: takes sessions by name.
        drawn: the sessions.
        names: what they are called.
        max_examples: how many of each, if nothing is found.

    Raises:
        Exception: what the check raised of the shortest found, with a note of what was met.
    """
    found: dict[str, Exception] = {}
    tries = [TRIES]

    @settings(
        max_examples=max_examples,
        deadline=None,
        suppress_health_check=SLOW,
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
            found[key] = error
            raise

    try:
        it_meets()
    except Flaky:  # chance: it was so once
        raise min(found.items(), key=lambda each: len(each[0]))[1] from None

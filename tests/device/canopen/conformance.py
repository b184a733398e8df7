"""Runs the conformance checks of tests/golden/canopen against a slave, in virtual time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from tests.device.canopen.check_text import Step, parse_checks
from tests.device.canopen.macros import MACROS
from tests.device.canopen.runner import Runner

GOLDEN: Final = Path(__file__).parents[2] / "golden" / "canopen"


class Check(NamedTuple):
    """One check of the suite."""

    id: str
    title: str
    needs: frozenset[str]
    steps: tuple[Step, ...]


class Actions(Protocol):
    """What `app` steps do to the slave from the inside."""

    def act(self, verb: str, *args: str) -> None:
        """Do it; AssertionError if something else was expected."""


class NotConformingError(AssertionError):
    """A step did not go as the check says; the text has the transcript."""


def load(path: Path) -> list[Check]:
    """Read the checks of a file, JSON or text."""
    text = path.read_text()
    rows = json.loads(text)["checks"] if path.suffix == ".json" else parse_checks(text)
    return [
        Check(row["id"], row["title"], frozenset(row.get("needs", ())), tuple(row["steps"]))
        for row in rows
    ]


def load_all() -> list[Check]:
    """Read all checks there are, those of files that were added too."""
    return [check for path in sorted(GOLDEN.glob("conformance*")) for check in load(path)]


def run_check(run: Runner, check: Check, actions: Actions) -> None:
    """Run a check on a node that has booted; NotConformingError if it does not pass."""
    run.boot()
    for number, step in enumerate(check.steps, 1):
        try:
            play(run, step, actions)
        except AssertionError as error:
            lines = "\n".join(f"    {line}" for line in run.transcript[-40:])
            text = f"{check.id} {check.title}\nstep {number}: {error}\n{lines}"
            raise NotConformingError(text) from error


def play(run: Runner, step: Step, actions: Actions) -> None:
    """Run one step."""
    match step:
        case {"send": text}:
            run.send(text, extended=step.get("ext", False))
        case {"expect": patterns, "in": within_ms}:
            run.expect(patterns, within_ms)
        case {"none": cob_id, "for": for_ms}:
            run.none(int(cob_id, 16), for_ms)
        case {"count": pattern, "for": for_ms, "min": least, "max": most}:
            run.count(pattern, for_ms, least, most)
        case {"wait": for_ms}:
            run.wait(for_ms)
        case {"drop": cob_id}:
            run.forget(int(cob_id, 16))
        case {"power": True}:
            run.power()
        case {"app": [verb, *args]}:
            run.flush()
            run.note(f"app {' '.join((verb, *args))}")
            actions.act(verb, *args)
        case {"macro": [name, *args]}:
            MACROS[name](run, *args)
        case _:
            raise ValueError(f"unknown step {step}")

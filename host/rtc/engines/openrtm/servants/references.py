"""Which reference stands for which component and execution context."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference
from tickrig.host.rtc.engines.openrtm.stubs import Stubs
from tickrig.host.rtc.remote.call_queue import CallQueue

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tickrig.host.rtc.component import RtComponent
    from tickrig.host.rtc.execution.execution_context import ExecutionContext
    from tickrig.host.rtc.states import ReturnCode


@dataclass(slots=True)
class _Entry:
    thing: RtComponent | ExecutionContext
    reference: Reference


class References:
    """The components and execution contexts that peers can call, by reference and back.

    What is entered and removed is so in the manager's thread; any thread looks things up.

    Args:
        orb: serves them.
        stubs: of our IDL.
        calls: those of the manager's thread.
        fixed: components come and go as their process decides: peers neither create nor end
            any, nor move one to another execution context.
    """

    def __init__(self, orb: Orb, stubs: Stubs, calls: CallQueue, *, fixed: bool = False) -> None:
        self.orb, self.stubs, self.calls, self.fixed = orb, stubs, calls, fixed
        self._by_id: dict[int, _Entry] = {}
        self._by_key: dict[bytes, _Entry] = {}

    def enter(
        self, thing: RtComponent | ExecutionContext, interface: str, *answers: object
    ) -> Reference:
        """Let peers call a component or execution context; see `Orb.serve`."""
        reference = self.orb.serve(self.stubs.skeleton(interface), *answers)
        entry = _Entry(thing, reference)
        self._by_id[id(thing)] = self._by_key[self.orb.key(reference)] = entry
        return reference

    def remove(self, thing: RtComponent | ExecutionContext) -> None:
        """Let nobody call it any more."""
        if (entry := self._by_id.pop(id(thing), None)) is not None:
            del self._by_key[self.orb.key(entry.reference)]
            self.orb.withdraw(entry.reference)

    def of(self, thing: RtComponent | ExecutionContext | None) -> Reference:
        """Return its reference; nil (None) if peers cannot call it."""
        entry = self._by_id.get(id(thing))
        return None if entry is None else entry.reference

    def all_of(self, things: Iterable[RtComponent | ExecutionContext]) -> list[Reference]:
        """Return the references of those that peers can call."""
        return [reference for thing in things if (reference := self.of(thing)) is not None]

    def find(self, reference: Reference) -> RtComponent | ExecutionContext | None:
        """Return what a reference stands for; None if that is not here."""
        key = self.orb.key(reference)
        entry = self._by_key.get(key) if key else None
        return None if entry is None else entry.thing

    def code(self, code: ReturnCode) -> Any:
        """Return a code as the stubs have it."""
        return self.stubs.rtc.ReturnCode_t._item(int(code))

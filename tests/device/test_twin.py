"""Twins of machines: what they share, what they have for themselves, what is refused."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import pytest

from tickrig.device.twin import (
    Cache,
    Copyable,
    Immutable,
    Listeners,
    NonCopyable,
    itself,
    pickler,
    restore,
    state_of,
    twin,
)


class Colour(Enum):
    RED = object()


class Plan(Immutable):
    def __init__(self, size: int) -> None:
        self.size = size


class Part:
    def __init__(self, count: int = 0) -> None:
        self.count = count

    def bump(self) -> None:
        self.count += 1


class Machine(Copyable):
    __slots__ = ("colour", "event", "listeners", "part", "plan")

    def __init__(self, part: Part) -> None:
        self.part, self.plan, self.colour = part, Plan(3), Colour.RED
        self.event: Callable[[], None] = part.bump
        self.listeners: Listeners[Callable[[], None]] = Listeners()


class Socket(NonCopyable):
    why_not_copied = "it is open"


COPIES: dict[str, Callable[[Machine], Machine]] = {
    "twin": twin,
    "deepcopy": copy.deepcopy,
    "within": lambda machine: copy.deepcopy({"rig": (machine,)})["rig"][0],
}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_bound_method_acts_on_the_twin(copied: Callable[[Machine], Machine]) -> None:
    machine = Machine(Part())
    other = copied(machine)
    other.event()
    assert (machine.part.count, other.part.count) == (0, 1)
    machine.event()
    assert (machine.part.count, other.part.count) == (1, 1)


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_twins_share_what_never_changes(copied: Callable[[Machine], Machine]) -> None:
    machine = Machine(Part())
    other = copied(machine)
    assert other.plan is machine.plan
    assert other.colour is Colour.RED


def test_a_pickle_has_everything_by_value() -> None:
    machine = Machine(Part(7))
    machine.colour = Colour  # type: ignore[assignment] # a value that another process knows
    other = pickle.loads(pickle.dumps(machine))
    assert (other.plan.size, other.part.count) == (3, 7)
    assert other.plan is not machine.plan


def test_a_description_is_its_own_copy() -> None:
    plan = Plan(1)
    assert copy.copy(plan) is plan
    assert copy.deepcopy([plan])[0] is plan


def test_nobody_listens_to_a_twin() -> None:
    machine = Machine(Part())
    machine.listeners.append(lambda: None)
    assert twin(machine).listeners == []
    assert type(twin(machine).listeners) is Listeners
    assert len(machine.listeners) == 1


class Heard(Copyable):
    _new_in_twins: ClassVar[Mapping[str, object]] = {"hear": None}

    def __init__(self) -> None:
        self.hear: object = [].append
        self.count, self.known = 3, Cache({1: 2})


class Ear(Heard):
    __slots__ = ("count", "hear", "known")


class Bat(Ear):
    """Has slots and other attributes."""

    _new_in_twins: ClassVar[Mapping[str, object]] = {"hear": None, "echo": None}

    def __init__(self) -> None:
        super().__init__()
        self.echo: object = lambda: None


class Tap:
    def __init__(self, part: Part) -> None:
        self.part, self.hear = part, lambda: None

    def __reduce__(self) -> tuple[Callable[[Part], Part], tuple[Part]]:
        return itself, (self.part,)


@pytest.mark.parametrize("made", [Heard, Ear, Bat])
def test_a_twin_begins_without_callbacks_and_caches(made: type[Heard]) -> None:
    machine = made()
    other = twin(machine)
    assert (other.hear, other.count, other.known) == (None, 3, {})
    assert type(other.known) is Cache
    assert (machine.hear, machine.known) != (None, {})


def test_a_listener_is_left_out_of_a_twin() -> None:
    machine = Machine(Part(4))
    machine.part = Tap(machine.part)  # type: ignore[assignment] # it listens to the part
    other = twin(machine)
    assert type(other.part) is Part
    other.event()
    assert other.part.count == 5


def test_machines_that_share_a_part_are_copied_with_one_part() -> None:
    part = Part()
    pair = (Machine(part), Machine(part), part)
    first, second, alone = copy.deepcopy(pair)
    assert first.part is second.part is alone
    assert alone is not part
    third, again = copy.deepcopy([pair[0], pair[0]])
    assert third is again


def test_the_class_of_a_twin_may_be_local() -> None:
    class Local(Copyable):
        pass

    assert type(twin(Local())) is Local


def test_a_shallow_copy_is_refused() -> None:
    with pytest.raises(TypeError, match=r"^Machine cannot be copied by copy\.copy: use"):
        copy.copy(Machine(Part()))


def test_what_belongs_to_its_process_says_why() -> None:
    for copied in (copy.copy, copy.deepcopy, twin, pickle.dumps):
        with pytest.raises(TypeError, match=r"^Socket cannot be copied or pickled: it is open$"):
            copied(Socket())


def test_a_closure_that_is_kept_as_state_is_refused() -> None:
    machine = Machine(Part())
    machine.event = lambda: None
    with pytest.raises(TypeError, match=r"^Machine cannot be copied: .*<lambda>"):
        twin(machine)


def test_an_item_that_was_shared_is_found_only_by_its_process() -> None:
    with pytest.raises(TypeError, match="item 3 of a twin was shared within its process"):
        pickler._shared(3)


class Compiled(Machine):
    """What mypyc makes of a machine: it says which attributes are in none of its `__dict__`s."""

    __mypyc_attrs__ = ("part", "never_set")
    part: Part


def test_attributes_of_a_compiled_machine_are_copied() -> None:
    machine = Compiled(Part(5))
    other = twin(machine)
    other.event()
    assert (machine.part.count, other.part.count) == (5, 6)


class AsCompiled:
    """Names its attributes as a compiled class does; `level` may be missing."""

    __slots__ = ("level", "name")
    __mypyc_attrs__ = ("name", "level")
    level: int

    def __init__(self, name: str) -> None:
        self.name = name

    def __getstate__(self) -> object:
        return state_of(self)


class AsDerived(AsCompiled):
    """A class of a user, derived from it: with a `__dict__` and a slot."""

    __slots__ = ("__dict__", "extra")


@dataclass(frozen=True, slots=True)
class AsFrozen:
    """A frozen value of a compiled class."""

    __mypyc_attrs__ = ("size",)
    size: int


def test_the_state_of_a_compiled_class_is_copied() -> None:
    copied = twin(AsCompiled("lamp"))
    assert copied.name == "lamp"
    assert not hasattr(copied, "level")


def test_so_is_that_of_a_class_derived_from_it() -> None:
    lamp = AsDerived("lamp")
    lamp.extra, lamp.free = 5, 6  # type: ignore[attr-defined] # as users do
    copied = twin(lamp)
    assert (copied.name, copied.extra, vars(copied)) == ("lamp", 5, {"free": 6})  # type: ignore[attr-defined]


def test_so_is_a_frozen_value_of_one() -> None:
    value = AsFrozen(5)
    copied = twin(value)
    assert copied == value
    assert copied is not value


def test_a_state_is_restored_with_what_a_twin_begins_with() -> None:
    lamp = AsCompiled("lamp")
    restore(lamp, state_of(lamp, {"level": 3}))
    assert lamp.level == 3
    plain = Plain()
    restore(plain, state_of(plain, {"level": 3}))
    assert vars(plain) == {"level": 3}


class Plain:
    """Has nothing but a `__dict__`."""


class Described(Immutable):
    """A description with slots that is no dataclass."""

    __slots__ = ("text",)

    def __init__(self, text: str) -> None:
        self.text = text


def test_a_pickle_has_a_description_by_value() -> None:
    assert pickle.loads(pickle.dumps(Described("lamp"))).text == "lamp"

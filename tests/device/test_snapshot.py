"""Snapshots put machines back in place: all that can change, and nothing that cannot be."""

from __future__ import annotations

import logging
import re
import socket
import threading
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Coroutine, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from io import BytesIO, StringIO
from random import Random
from types import MappingProxyType
from typing import Any

import pytest

from tickrig.device.twin import Immutable, NonCopyable
from tickrig.device.twin.snapshot import MachineSnapshot


class Slotted:
    __slots__ = ("later", "value")
    later: object

    def __init__(self, value: object) -> None:
        self.value = value


class Open:
    def __init__(self, value: object) -> None:
        self.value = value

    def read(self) -> object:
        return self.value


@dataclass(frozen=True)
class Frozen:
    items: list[int] = field(default_factory=list)


class Described(Immutable):
    def __init__(self) -> None:
        self.asked = 0


class Offer:
    """Knows its own way back."""

    def __init__(self) -> None:
        self.names = ["first"]

    def way_back(self) -> Callable[[], None]:
        return partial(self.names.__delitem__, slice(len(self.names), None))


class Port(NonCopyable):
    """Belongs to its process."""


def counter() -> Callable[[], int]:
    count = 0

    def one_more() -> int:
        nonlocal count
        count += 1
        return count

    return one_more


CONTAINERS: dict[str, tuple[Any, Callable[[Any], object]]] = {
    "list": ([1, 2], lambda item: item.append(3)),
    "sorted list": ([1, 2], lambda item: item.reverse()),
    "dict": ({"a": 1}, lambda item: item.pop("a")),
    "dict with another value": ({"a": 1}, lambda item: item.update(a=2, b=3)),
    "ordered dict": (OrderedDict(a=1, b=2), lambda item: item.move_to_end("a")),
    "counter": (Counter("aab"), lambda item: item.update("b")),
    "set": ({1, 2}, lambda item: item.add(3)),
    "deque": (deque([1, 2], 2), lambda item: item.append(3)),
    "bytearray": (bytearray(b"ab"), lambda item: item.extend(b"c")),
}


@pytest.mark.parametrize(("item", "change"), CONTAINERS.values(), ids=CONTAINERS)
def test_a_container_is_put_back(item: Any, change: Callable[[Any], object]) -> None:
    holder = {"one": (item,), "other": item}
    before = list(item)
    snapshot = MachineSnapshot(holder)
    for _ in range(2):
        change(item)
        assert list(item) != before or isinstance(item, dict)
        holder["other"] = None
        snapshot.restore()
        assert list(item) == before
        assert holder["one"][0] is holder["other"] is item


def test_values_of_a_dict_are_put_back() -> None:
    numbers = {"a": 1}
    snapshot = MachineSnapshot(numbers)
    numbers["a"] = 2
    snapshot.restore()
    assert numbers == {"a": 1}


def test_attributes_are_put_back_and_new_ones_go() -> None:
    opened, slotted = Open(1), Slotted(1)
    snapshot = MachineSnapshot(opened, slotted)
    opened.value, opened.later = 2, 3  # type: ignore[attr-defined] # it has a __dict__
    slotted.value, slotted.later = 2, 3
    for _ in range(2):
        snapshot.restore()
        assert vars(opened) == {"value": 1}
        assert (slotted.value, hasattr(slotted, "later")) == (1, False)


@pytest.mark.parametrize(
    "reached",
    [
        lambda item: item,
        Slotted,
        Frozen,
        lambda item: (item, 1),
        lambda item: MappingProxyType({1: item}),
        lambda item: partial(print, item),
        lambda item: item.append,
        lambda item: Open(item).read,
        lambda item: lambda: item,
        ValueError,
        lambda item: {1: item}.values(),
    ],
)
def test_it_is_found_wherever_it_is(reached: Callable[[list[int]], object]) -> None:
    item = [1]
    snapshot = MachineSnapshot(reached(item))
    item.append(2)
    snapshot.restore()
    assert item == [1]


def test_what_a_function_has_is_put_back() -> None:
    one_more = counter()
    one_more()
    snapshot = MachineSnapshot(one_more)
    assert one_more() == 2
    snapshot.restore()
    assert one_more() == 2


def test_a_function_whose_cell_is_empty_is_left_alone() -> None:
    def asks() -> object:
        return later

    MachineSnapshot(asks).restore()
    later = 1
    assert asks() == 1


def test_chance_and_buffers_are_put_back() -> None:
    chance, data, text = Random(1), BytesIO(b"ab"), StringIO("ab")
    snapshot = MachineSnapshot([chance, data, text])
    thrown = chance.random(), data.read(), text.read()
    data.write(b"c")
    snapshot.restore()
    assert (chance.random(), data.read(), text.read()) == thrown
    assert (data.getvalue(), text.getvalue()) == (b"ab", "ab")


def test_what_is_shared_by_twins_stays_as_it_is() -> None:
    shared = Described()
    lock, logger = threading.Lock(), logging.getLogger("a host")
    snapshot = MachineSnapshot([shared, re.compile("a"), Described, re, lock, logger])
    shared.asked = 1
    with lock:
        snapshot.restore()
    assert shared.asked == 1


def test_what_knows_its_way_back_goes_it() -> None:
    offer = Offer()
    snapshot = MachineSnapshot(offer)
    offer.names.append("second")
    snapshot.restore()
    assert offer.names == ["first"]


def once(item: list[int]) -> Iterator[int]:
    yield len(item)
    yield len(item)


def test_what_a_generator_has_is_put_back_where_it_stands() -> None:
    async def body() -> None:
        """Do nothing."""

    item = [1, 2]
    waiting, over = once(item), once([])
    assert (next(waiting), list(over)) == (2, [0, 0])
    coroutine: Coroutine[Any, Any, None] = body()
    with closing(coroutine):
        snapshot = MachineSnapshot(waiting, over, coroutine)
        item.append(3)
        snapshot.restore()
    assert (item, next(waiting)) == ([1, 2], 2)
    snapshot = MachineSnapshot(waiting)
    next(waiting, None)
    with pytest.raises(TypeError, match="generator once has gone on, and cannot be put back"):
        snapshot.restore()


def test_a_generator_amid_a_loop_is_refused() -> None:
    waiting = (number for number in [1, 2])
    next(waiting)
    with pytest.raises(TypeError, match="tuple_iterator cannot be put back, and generator has one"):
        MachineSnapshot(waiting)


def test_what_cannot_be_put_back_is_refused() -> None:
    with socket.socket() as item, pytest.raises(TypeError) as caught:
        MachineSnapshot({"port": [item]})
    assert str(caught.value) == "socket cannot be put back, and list has one"
    with pytest.raises(TypeError, match="Port cannot be put back, and Open has one"):
        MachineSnapshot(Open(Port()))

from __future__ import annotations

import time

from tickrig.emulators.can.outside.sim_network import retime, retimed


class Watch:
    """Reads the clock in all ways a class can."""

    def __init__(self) -> None:
        self.started = self.now()

    def now(self, *, offset: float = 1.0) -> float:
        return time.time() + offset

    @property
    def age(self) -> float:
        return time.time() - self.started

    @age.setter
    def age(self, age: float) -> None:
        self.started = time.time() - age

    def plain(self) -> str:
        return "plain"


class Loud(Watch):
    def now(self, *, offset: float = 2.0) -> float:
        return super().now(offset=offset) + 1_000


class Frozen:
    @staticmethod
    def time() -> float:
        return 100.0


NAMES = {"time": Frozen}
LIBRARY = __name__.partition(".")[0]


def test_a_retimed_object_sees_the_other_clock_and_others_do_not() -> None:
    one, other = Watch(), Watch()
    retime(one, NAMES, LIBRARY)
    assert (one.now(), one.now(offset=0)) == (101, 100)
    one.age = 7
    assert (one.started, one.age) == (93, 7)
    assert other.now() > 1e9
    assert isinstance(one, Watch)
    assert type(one).__name__ == "Watch"
    assert type(one).plain is Watch.plain


def test_what_a_subclass_overrides_is_not_replaced_by_its_base() -> None:
    loud = Loud()
    retime(loud, NAMES, LIBRARY)
    assert loud.now() > 1e9
    loud.age = 0
    assert loud.started == 100


def test_classes_of_others_stay_as_they_are() -> None:
    assert retimed(Watch, NAMES, "canopen") is Watch
    assert retimed(Watch, {"nothing": 0}, LIBRARY) is Watch
    watch = Watch()
    retime(watch, {"nothing": 0}, LIBRARY)
    assert type(watch) is Watch

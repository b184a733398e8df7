from __future__ import annotations

from typing import Any

import pytest

from tests.host.rtc.chain import PERIOD_US, make_manager
from tests.host.rtc.spy import BrokenError
from tickrig.host.rtc import LifeCycleState, Manager, RtcRefused
from tickrig.host.rtc.components import ConfigSample
from tickrig.host.rtc.configuration import Configuration, Constraint, Parameter, as_text


@pytest.mark.parametrize(
    ("text", "allowed", "refused"),
    [
        ("", [0, -1.5, "word"], []),
        ("none", [0, "word"], []),
        ("x>=0", [0, 0.5], [-1, -0.001]),
        ("x > 0", [1], [0]),
        ("x<10", [9], [10]),
        ("x<=10", [10], [11]),
        ("0<x", [1], [0]),
        ("0<=x<=10", [0, 10], [-1, 11]),
        ("-1.5<x<1e3", [-1.4, 999], [-1.5, 1000]),
        ("10>x>0", [5], [0, 10]),
        ("x=5", [5], [4]),
        ("x==5", [5], [4]),
        ("(slow, fast)", ["slow", "fast"], ["", "slower"]),
        ("(1,2)", [1, 2], [3]),
        ("x>0", [(1, 2)], [(1, 0), ("word",)]),
        ("x>0, x<5", [(1, 4)], [(0, 4), (1, 5), (1,), 3]),
    ],
)
def test_a_constraint_allows_what_its_notation_says(
    text: str, allowed: list[Any], refused: list[Any]
) -> None:
    constraint = Constraint(text)
    assert [value for value in allowed if not constraint.allows(value)] == []
    assert [value for value in refused if constraint.allows(value)] == []
    assert str(constraint) == text


@pytest.mark.parametrize("text", ["x", "x>", "y>0", "0<5", "(a", "{key0:x>0}", "x>0,", "1.2.3<x"])
def test_a_constraint_in_another_notation_is_a_value_error(text: str) -> None:
    with pytest.raises(ValueError, match="constraint"):
        Constraint(text)


@pytest.mark.parametrize(
    ("default", "text", "value"),
    [
        (0, "5", 5),
        (0, "0x10", 16),
        (0.5, "1e3", 1000.0),
        (False, "true", True),
        (True, "No", False),
        ("a", "b c", "b c"),
        ((1, 2), "3, 4,5", (3, 4, 5)),
        ((0.5,), "1", (1.0,)),
        (("a",), "b,c", ("b", "c")),
    ],
)
def test_a_parameter_reads_text_as_the_type_of_its_default(
    default: Any, text: str, value: Any
) -> None:
    parameter = Parameter("p", default)
    assert parameter.parse(text) == value
    assert type(parameter.parse(text)) is type(default)
    assert parameter.parse(parameter.text) == default
    assert parameter.parse(as_text(value)) == value


@pytest.mark.parametrize(
    ("default", "text"),
    [(0, "1.5"), (0, ""), (0.5, "nan"), (0.5, "fast"), (False, "2"), ((1,), "1,a")],
)
def test_a_text_that_is_no_such_value_is_refused(default: Any, text: str) -> None:
    with pytest.raises(RtcRefused, match="p takes a value like"):
        Parameter("p", default).parse(text)


def test_a_value_outside_its_constraint_is_refused_with_its_unit() -> None:
    with pytest.raises(RtcRefused, match=r"p = 11 is not in 0<=x<=10 mm"):
        Parameter("p", 1, "0<=x<=10", unit="mm").parse("11")


def test_a_default_outside_its_constraint_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="p = 1 is not in its constraint x>1"):
        Parameter("p", 1, "x>1")


def configured() -> tuple[Configuration, Parameter[int]]:
    configuration = Configuration()
    return configuration, configuration.bind("speed", 1, "x>=0")


def test_a_value_takes_effect_at_the_next_update() -> None:
    configuration, speed = configured()
    configuration.set("speed", "5")
    assert (speed.value, configuration.changed) == (1, True)
    configuration.update()
    assert (speed.value, configuration.changed) == (5, False)


def test_the_active_set_decides_and_what_it_leaves_out_has_its_default() -> None:
    configuration, speed = configured()
    name = configuration.bind("name", "a")
    configuration.add_set("fast", {"speed": "9"})
    configuration.set("name", "b")
    configuration.activate("fast")
    configuration.update()
    assert (speed.value, name.value, configuration.active_id) == (9, "a", "fast")
    assert dict(configuration.sets) == {
        "default": {"speed": "1", "name": "b"},
        "fast": {"speed": "9"},
    }
    assert list(configuration.parameters) == ["speed", "name"]


def test_a_set_may_be_changed_while_another_is_active() -> None:
    configuration, speed = configured()
    configuration.add_set("fast", {})
    configuration.set("speed", "7", "fast")
    configuration.update()
    assert speed.value == 1


def test_a_set_in_use_stays() -> None:
    configuration, _ = configured()
    configuration.add_set("fast", {})
    configuration.activate("fast")
    for set_id in ("fast", "default"):
        with pytest.raises(RtcRefused, match="in use"):
            configuration.remove_set(set_id)
    configuration.activate("default")
    configuration.remove_set("fast")
    assert list(configuration.sets) == ["default"]


def test_names_that_are_not_there_are_refused() -> None:
    configuration, _ = configured()
    with pytest.raises(RtcRefused, match="no parameter 'sped'; known: speed"):
        configuration.set("sped", "1")
    with pytest.raises(RtcRefused, match="no configuration set 'slow'; known: default"):
        configuration.activate("slow")
    with pytest.raises(RtcRefused, match="no parameter 'x'; known: none"):
        Configuration().add_set("s", {"x": "1"})


def test_a_set_with_one_wrong_value_is_not_added() -> None:
    configuration, _ = configured()
    with pytest.raises(RtcRefused):
        configuration.add_set("fast", {"speed": "-1"})
    assert list(configuration.sets) == ["default"]


def test_a_listener_is_told_the_set_after_the_values_hold() -> None:
    configuration, speed = configured()
    told: list[tuple[str, int]] = []
    configuration.on_update.append(lambda set_id: told.append((set_id, speed.value)))
    configuration.set("speed", "2")
    configuration.update()
    assert told == [("default", 2)]


def sample() -> tuple[Manager, ConfigSample]:
    manager = make_manager()
    return manager, manager.add(ConfigSample("ConfigSample0"))


@pytest.mark.parametrize("active", [False, True])
def test_a_component_sees_a_change_from_its_next_period_on(active: bool) -> None:
    manager, component = sample()
    if active:
        manager.activate("ConfigSample0")
    values: list[tuple[float, ...]] = []
    component.configuration.set("vector_param0", "1,2,3")
    for duration_us in (PERIOD_US - 1, 1):
        manager.run_for(duration_us)
        values.append(component.vector_param0.value)
    assert values == [(0.0, 1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0)]


def test_a_listener_that_raises_brings_its_component_into_error() -> None:
    manager, component = sample()

    def listener(set_id: str) -> None:
        raise BrokenError

    component.configuration.on_update.append(listener)
    manager.activate("ConfigSample0")
    component.configuration.set("int_param0", "5")
    manager.run_for(2 * PERIOD_US)
    assert manager.state_of("ConfigSample0") is LifeCycleState.ERROR


def test_a_value_that_is_set_before_initialize_counts_from_there() -> None:
    sample = ConfigSample("ConfigSample0")
    sample.configuration.set("int_param0", "7")
    sample.initialize()
    assert sample.int_param0.value == 7

"""Mistakes that writers of devices make are found, and told so that they can be mended."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import settings

from tests.emulators.testing.properties import mixer
from tests.emulators.testing.properties.mixer import Mixer
from tickrig import CanFrame, DeviceType, LineSettings
from tickrig.emulators.can.wire import CanWire
from tickrig.testing import DeviceFuzz, check_device, strategies

WORDS = strategies.chunks([b"ON\n", b"OFF\n", b"?\n"])


@pytest.fixture(autouse=True)
def not_kept() -> Iterator[None]:
    """What is found is shortened, as it is for users, and forgotten."""
    settings.register_profile("not kept", settings(), database=None)
    settings.load_profile("not kept")
    yield
    settings.load_profile("tickrig")


def found(device: Any, **options: Any) -> str:
    with pytest.raises(AssertionError) as caught:
        check_device(device, traffic=WORDS, **options)
    return str(caught.value)


@pytest.mark.parametrize("baud", [19_200, 1_000_000])
def test_a_mixer_without_mistake_passes(baud: int) -> None:
    line = LineSettings(baud=baud)
    check_device(
        DeviceType(name="mixer", title="Mixer", build=lambda config: Mixer(), line=line),
        traffic=WORDS,
        max_examples=10,
    )


def test_a_forgotten_timer_of_half_a_minute_is_found() -> None:
    text = found(mixer.ForgetsStop)
    assert "a tick that is not due changes something: at 30.001000 s state 'Idle' after" in text
    assert "'Mixing' without it; at 2000.000 ms due_us said NEVER, it must be at most 300" in text


def test_a_forgotten_timer_that_an_input_starts_is_found() -> None:
    assert "state 'Error'" in found(mixer.ForgetsTrip)


@pytest.mark.parametrize(("bad", "text"), [(mixer.NoPeriod, "tick_us"), (mixer.DueNone, "due_us")])
def test_a_fuzzer_tells_a_period_that_is_none(bad: Callable[[], Any], text: str) -> None:
    with pytest.raises(AssertionError, match=text):
        DeviceFuzz(bad)


def test_a_forgotten_timer_that_only_answers_show_is_found() -> None:
    text = found(mixer.Unseen, start=[(5_000, "send", b"ON\n")], max_examples=2_000)
    assert r"a tick that is not due changes what follows b'?\n': by 8640" in text
    assert r"it sends b'Idle\n' after a tick before, b'Mixing\n' without it" in text


@pytest.mark.parametrize("baud", [19_200, 115_200, 1_000_000])
def test_a_device_that_keeps_no_half_line_is_found(baud: int) -> None:
    line = LineSettings(baud=baud)
    text = found(DeviceType(name="m", title="m", build=lambda config: mixer.HalfLines(), line=line))
    assert text.startswith("a pause in a word makes a difference: after b'")
    assert "in the next tick it sends b'ERR\\nERR\\n', after b'O" in text


def test_where_a_pause_ends_what_is_sent_none_is_made() -> None:
    check_device(mixer.HalfLines, traffic=WORDS, max_examples=5, pauses=False)


def test_of_a_word_of_several_lines_the_first_is_cut() -> None:
    both = strategies.chunks([b"ON\n?\n"])
    check_device(Mixer, traffic=both, max_examples=5)
    with pytest.raises(AssertionError, match="and b'N\\\\n\\?\\\\n' in the next tick"):
        check_device(mixer.HalfLines, traffic=both)


def test_dense_and_sparse_ticks_say_when_what_and_what_was_due() -> None:
    start = [(5_000, "send", b"ON\n"), (29_999_000, "send", b"?\n")]
    assert found(mixer.ForgetsStop, start=start).startswith(
        "dense and sparse ticks differ: at 30.006000 s state 'Idle' if every tick is run, "
        "'Mixing' if those that due_us passes over are not; due_us said NEVER"
    )


@pytest.mark.parametrize("bad", [mixer.Clocked, mixer.Sharing])
def test_chance_and_what_devices_share_are_told_as_such(bad: Callable[[], Mixer]) -> None:
    text = found(bad)
    assert text.startswith(
        "two fresh devices that met the same differ (chance, the machine's clock, or state that "
        "they share): by "
    )
    assert " of one, b'" in text


def test_what_a_reset_leaves_of_an_input_is_found_by_the_first_session() -> None:
    text = found(mixer.KeepsFault, start=[(5_000, "send", b"ON\n")], max_examples=1)
    assert text.startswith("reset keeps something")


def test_what_a_reset_leaves_is_found() -> None:
    jammed = [(5_000, "send", b"ON\n"), (5_000, "set", ("jam", 1)), (600_000, "send", b"?\n")]
    text = found(mixer.KeepsError, start=jammed)
    assert text.startswith("reset keeps something (if it is to: check_device(remembers=True)): at ")
    assert "state 'Error' after a reset, 'Idle' of a fresh one" in text
    check_device(mixer.KeepsError, start=jammed, max_examples=3, remembers=True)


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        (mixer.LeavesChanged, "LeavesChanged.tick leaves inputs.changed set: it is cleared"),
        (mixer.TicksNone, "TicksNone.tick returned None: it returns bytes, b'' for none"),
        (mixer.TicksText, "TicksText.tick returned str: it returns bytes"),
        (mixer.ReadsNone, "ReadsNone.read('state') returned None: a number or a text"),
        (mixer.NoPeriod, "NoPeriod.tick_us is 0: whole microseconds above 0"),
        (mixer.RealPeriod, "RealPeriod.tick_us is 1000.0: whole microseconds above 0"),
        (mixer.DueNone, "DueNone.due_us is None: whole microseconds, or NEVER"),
        (mixer.DueReal, "DueReal.due_us is 0.0: whole microseconds, or NEVER"),
        (mixer.NoInputs, "NoInputs has no inputs: an InputBank, InputBank(()) if there are none"),
        (mixer.NoOutputs, "NoOutputs has no outputs: a dict of OutputSignal by name, {} if"),
        (mixer.NoReset, "NoReset has no tick: tick(now_us, rx) returns what it sends"),
    ],
)
def test_what_is_no_device_is_told_in_a_line(bad: Callable[[], Any], text: str) -> None:
    assert found(bad).partition("\n")[0].startswith(text)


@pytest.mark.parametrize(
    ("act", "text"),
    [
        ((5_000, "sned", b"ON\n"), "no act 'sned'; did you mean 'send'? (send, set, reset)"),
        (("5ms", "send", b"ON\n"), "the wait is in whole microseconds, got '5ms'"),
        ((-1, "send", b"ON\n"), "the wait is in whole microseconds, got -1"),
        ((5_000, "set", "jam", 1), "an act is (wait in us, verb, what), got (5000, 'set', 'jam'"),
        ((5_000, "set", "jam"), "set takes (name, value), got 'jam'"),
        ((5_000, "set", ("jamm", 1)), "no input 'jamm'; known: jam, no_power"),
        ((5_000, "send", "ON\n"), r"send takes bytes, got 'ON\n'"),
        ((5_000, "reset", 1), "reset takes None, got 1"),
    ],
)
def test_an_act_that_cannot_be_done_is_refused(act: Any, text: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the text is looked at
        check_device(Mixer, traffic=WORDS, start=[(0, "reset", None), act])
    assert str(caught.value).startswith(f"start[1]: {text}")


@pytest.mark.parametrize("what", [b"", (b"",), (1,)])
def test_so_is_one_on_can(what: Any) -> None:
    with pytest.raises(ValueError, match=r"start\[1\]: send takes a tuple of CanFrame, got"):
        check_device(
            mixer.NoInputs,
            wire=CanWire,
            start=[(0, "send", (CanFrame(5, b""),)), (0, "send", what)],
        )
    with pytest.raises(ValueError, match=r"start\[0\]: NoInputs has no inputs to set"):
        check_device(mixer.NoInputs, wire=CanWire, start=[(0, "set", ("jam", 1))])


def test_a_device_type_is_named() -> None:
    check_device("urg", max_examples=1, remembers=True)
    with pytest.raises(ValueError, match="no device 'ugr'; did you mean 'urg'"):
        check_device("ugr")
    with pytest.raises(ValueError, match="a device type, its name, a class or a function, got <"):
        check_device(Mixer())  # type: ignore[arg-type] # a user's mistake


@pytest.mark.parametrize("words", [b"ON\n", "ON\n"])
def test_words_are_a_list_of_bytes(words: Any) -> None:
    with pytest.raises(ValueError, match=r'a list of bytes, as \[b"ON'):
        strategies.chunks(words)
    with pytest.raises(ValueError, match="a word is bytes, got 'ON"):
        strategies.chunks(["ON\n"])  # type: ignore[list-item] # a user's mistake


def test_what_was_found_is_not_shortened_for_ever() -> None:
    made = 0

    def make() -> Mixer:
        nonlocal made
        made += 1
        return mixer.ForgetsStop()

    assert "Failing test case" in "".join(_notes(make))
    assert made < 3_000


def _notes(make: Callable[[], Mixer]) -> list[str]:
    with pytest.raises(AssertionError) as caught:
        check_device(make, traffic=WORDS)
    return caught.value.__notes__


def test_a_reset_that_leaves_nothing_due_is_replayed_where_it_was() -> None:
    answers_late = [(10_000, "send", b"ON\n"), (2_000, "reset", None)]
    check_device(mixer.Late, start=answers_late, max_examples=1)

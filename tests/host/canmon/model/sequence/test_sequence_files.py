from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.sequence import (
    TomlSequence,
    evaluate,
    fill_in,
    outline,
    parse_lines,
    parse_pattern,
    parse_variable,
)
from tickrig.host.text.steps import StepError
from tickrig.wire.can import CanFrame


def refused(text: str) -> str:
    with pytest.raises(StepError) as caught:
        TomlSequence(text, "a.toml").parse()
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a.toml:1: no [[step]]"),
        ("step = []\n", "a.toml:1: no [[step]]"),
        ("[[step]]\nsend = \n", "a.toml:2: a value is missing before the end of the line"),
        ('[[step]]\nsend = "080#', "a.toml:2: "),
        ('\n[[step]]\nsend = "080"\n', "a.toml:3: '080' is not a frame like 705#7F"),
        ('[[step]]\nsned = "080#"\n', "a.toml:1: a step has one of send, wait, expect, repeat;"),
        ('[[step]]\nsend = "080#"\nwait = "1s"\n', "this one has send and wait"),
        ('[[step]]\nsend = "080#"\nwithin = "1s"\n', "a.toml:3: no key 'within' here; known: send"),
        ('[[step]]\nwait = "5 min"\n', "a.toml:2: '5 min' is not a time"),
        ("[[step]]\nwait = 5\n", "a.toml:2: 5 is not a time: write '1.5s'"),
        ('[[step]]\nexpect = "70#"\n', "a.toml:2: '70#' is not a frame like 705#05"),
        ('[[step]]\nexpect = "emcy"\n', "a.toml:2: 'emcy' is not a frame like 705#05"),
        ("[[step]]\nexpect = []\n", "a.toml:2: expect takes a text or a list of texts, got []"),
        ('[[step]]\nexpect = "705#"\nwithin = "0s"\n', "within takes a time above 0"),
        ('[[step]]\nexpect = "705#"\non-fail = "retry"\n', "'stop', 'go-on' or a list of steps"),
        ('[[step]]\nexpect = "705#"\non-fail = [\n 1]\n', "a.toml:3: on-fail = [1] is no list"),
        ('[[step]]\nrepeat = 0\nsteps = [{send = "080#"}]\n', "a.toml:2: repeat takes 1 or more"),
        ("[[step]]\nrepeat = 2\n", "a.toml:2: repeat has no steps"),
        ('[[step]]\nrepeat = "forever"\nsteps = [{send = "080#"}]\n', "'forever' takes no time"),
        (
            '[[step]]\nrepeat = 2\nsteps = [\n {send = "080#"},\n {wait = "x"},\n]\n',
            "a.toml:5: 'x' is not a time",
        ),
        ('[[step]]\nsend = "70{id}#"\n', "a.toml:2: no variable 'id'; known: none; give --var"),
        ("[vars]\nid = 'x'\n[[step]]\nwait='1s'\n", "a.toml:2: id = 'x' is no whole number"),
        ("vars = 1\n", "a.toml:1: vars = 1 is no table"),
        ("step = 1\n", "a.toml:1: step = 1 is no list of steps"),
        ('[[step]]\nsnd = "080#"\nwait = "1s"\n', "a.toml:2: no key 'snd' here; known: wait"),
        ('[[step]]\nexpect = "080#"\nwithn = "1s"\n', "did you mean 'within'?"),
        ("[bus]\n[[step]]\nwait='1s'\n", "a.toml:1: no key 'bus' here; known: name, vars, step"),
    ],
)
def test_a_mistake_is_told_with_its_line(text: str, said: str) -> None:
    assert said in refused(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("+10 080\n", "a.seq:1: '080' is not a frame"),
        ("\n10 080#\n", "a.seq:2: '10 080#' is not '+MS ID#DATA'"),
        ("+1 080#\nloop 2\n", "a.seq:2: loop stands before the first frame"),
        ("loop 0\n+1 080#\n", "a.seq:1: loop takes 1 or more, or forever; got 0"),
        ("loop forever\n+0 080#\n", "a.seq:1: loop forever takes no time"),
        ("", "a.seq:1: no frame, as '+10 123#DEADBEEF'"),
        ("loop 3  # times nothing\n", "a.seq:1: no frame"),
        ("+1 FFF#\n", "a.seq:1: CAN-ID 0xFFF is not 11-bit"),
    ],
)
def test_a_mistake_in_a_line_is_told_with_its_number(text: str, said: str) -> None:
    with pytest.raises(StepError, match=r"^a\.seq:") as caught:
        parse_lines(text, "a.seq")
    assert said in str(caught.value)


def test_the_sequence_of_the_page_can_be_carried_out() -> None:
    page = (Path(__file__).parents[5] / "docs/reference/canmon/canmon-sending.md").read_text(
        "utf-8"
    )
    match = re.search(r"^```toml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert match is not None
    assert outline(TomlSequence(match[1], "page.toml").parse().steps)[:2] == [
        "send 000#0105",
        "expect 705#05 within 300 ms, else go on",
    ]


def test_a_sequence_is_told_without_a_bus() -> None:
    text = """
    [[step]]
    repeat = 2
    steps = [{ send = ["000#01", "080#"] }, { wait = "2.5ms" }]
    [[step]]
    expect = ["705#05", "706#*"]
    on-fail = [{ send = "000#80" }]
    """
    assert outline(TomlSequence(text, "a.toml").parse().steps) == [
        "repeat 2",
        "  send 000#01 080#",
        "  wait 2.5 ms",
        "expect 705#05 and 706#* within 1000 ms, else stop",
        "  send 000#80",
    ]


def test_a_variable_of_the_command_line_goes_before_that_of_the_file() -> None:
    text = '[vars]\nid = 3\n[[step]]\nsend = "000#01{id}"\n'
    assert outline(TomlSequence(text, "a.toml", {"id": 9}).parse().steps) == ["send 000#0109"]


def test_names_are_resolved_by_whoever_knows_them() -> None:
    text = '[[step]]\nsend = "5.rpdo1 target={2*50}"\n'
    said: list[str] = []

    def resolve(words: str) -> CanFrame:
        said.append(words)
        return CanFrame(0x205)

    TomlSequence(text, "a.toml", resolve=resolve).parse()
    assert said == ["5.rpdo1 target=100"]


@pytest.mark.parametrize(
    ("text", "filled"),
    [
        ("{n}", "0A"),
        ("{n:1}", "A"),
        ("{n*2-1:4}", "0013"),
        ("{-n:i16}", "F6FF"),
        ("{n<<4|1:u24}", "A10000"),
        ("{n//3%2^1&3}", "00"),
        ("{n>>1}", "05"),
        ("{-n:d}", "-10"),
    ],
)
def test_a_field_is_written_as_it_says(text: str, filled: str) -> None:
    assert fill_in(f"#{text}", {"n": 10}) == f"#{filled}"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{x}", "no variable 'x'; known: n"),
        ("{300}", "300 = 300 does not fit '2'"),
        ("{-1}", "does not fit '2'"),
        ("{200:i8}", "does not fit 'i8'"),
        ("{n:9}", "1 to 8 hex digits"),
        ("{n:u7}", "1 to 8 hex digits"),
        ("{n/2}", "is no whole number"),
        ("{}", "is no whole number"),
        ("{1//0}", "is no whole number"),
        ("{True}", "is no whole number"),
        ("{__import__('os')}", "is no whole number"),
        ("{1<<99}", "is no shift; 0 to 64 is"),
        ("{(1<<63)*4}", "has more than 64 bits"),
    ],
)
def test_a_field_that_is_no_number_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        fill_in(f"#{text}", {"n": 10})


@given(st.text(max_size=20))
def test_an_expression_gives_a_number_or_says_why_not(text: str) -> None:
    try:
        assert isinstance(evaluate(text, {"a": 1}), int)
    except ValueError as error:
        assert str(error)  # noqa: PT017 - either is right


@pytest.mark.parametrize("text", ["id", "=3", "id=x", "1a=3"])
def test_what_is_no_variable_is_refused(text: str) -> None:
    assert parse_variable("id=0x10") == ("id", 16)
    with pytest.raises(ValueError, match="is not NAME=NUMBER"):
        parse_variable(text)


@pytest.mark.parametrize(
    ("pattern", "frame", "fits"),
    [
        ("705#05", "705#05", True),
        ("705#05", "705#0500", False),
        ("7?5#*", "745#0102", True),
        ("7?5#*", "645#0102", False),
        ("705#0?.FF", "705#0AFF", True),
        ("00000705#", "705#", False),
        ("705#R", "705#R", True),
        ("705#R", "705#", False),
        ("705#*", "705#R", False),
    ],
)
def test_a_pattern_fits_what_it_means(pattern: str, frame: str, fits: bool) -> None:
    assert parse_pattern(pattern).matches(Record(0, "can0", CanFrame.parse(frame))) is fits

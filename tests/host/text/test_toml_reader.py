from __future__ import annotations

import tomllib
from random import Random

import pytest

from tickrig.host.text.toml_reader import BROKEN, ONE_LINE, read_toml

TEXT = '''\
# a comment with [[step]]
name = """
[[step]]
"""

[[step]]
send = "000#"

[[step]]
repeat = 2
steps = [
  { send = "080#" },
  { wait = "10ms", also = [1,
     2] },
]

[vars]
id = 3
deep.er = { "quoted key".x = 0x1F, y = 'z' }
deep.est = 1979-05-27 07:32:00
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("name",), 2),
        (("step", 0), 6),
        (("step", 0, "send"), 7),
        (("step", 1), 9),
        (("step", 1, "steps", 0), 12),
        (("step", 1, "steps", 1, "also", 1), 14),
        (("vars", "id"), 18),
        (("vars", "deep"), 19),
        (("vars", "deep", "er", "quoted key", "x"), 19),
        (("vars", "deep", "est"), 20),
        (("vars", "not there"), 17),
        (("nowhere",), 1),
    ],
)
def test_a_value_is_found_where_it_stands(path: tuple[str | int, ...], line: int) -> None:
    assert read_toml(TEXT).line_of(path) == line


def test_the_values_are_those_of_the_standard_library() -> None:
    assert read_toml(TEXT).values == tomllib.loads(TEXT)


@pytest.mark.parametrize(
    ("text", "mistakes"),
    [
        ("a = [1, 2\n[b]\n", ["1: ']' of the array is missing"]),
        ("a = [1,\n2,\nb = 1\n", ["1: ']' of the array is missing"]),
        ("a = [\n 1,\n x,\n 3,\n]\n", ["3: 'x' is no value: a text stands in quotes"]),
        ("a = [1,,2]", ["1: a value is missing before ',2]'"]),
        ("a = {x = 1\nb = 2", ["1: '}' of the inline table is missing"]),
        (
            "a = {x = 1,\n y = 2,\n}\n",
            [f"1: {ONE_LINE}"],
        ),
        ("a = {x = 1,}", ["1: ',' is too much at the end of an inline table"]),
        ('"he\ufeffllo" world\n', ["1: '=' is missing behind 'he\\ufeffllo'"]),
        ("hello world\n", ["1: '=' is missing behind hello"]),
        ("a =\n", ["1: a value is missing before the end of the line"]),
        ("[a.b\nc = 1", ["1: ']' is missing behind a.b"]),
        ('a = "x\nb = 1', ["1: the text '\"x' does not end"]),
        ('a = """x\n', ['1: the text \'"""x\' does not end']),
        ("a = yes", ["1: 'yes' is no value: a text stands in quotes"]),
        ("a = 1.2.3 # c", ["1: '1.2.3' is no value: it is no number"]),
        ('a = "\x00"', ["""1: '"\\x00"' is no value: Illegal character '\\x00'"""]),
        ("a = 1\nb = 2\na = 3", ["3: 'a' stands in line 1 already"]),
        ("[a]\nb = 1\n[a]\nc = 1", ["3: 'a' stands in line 1 already"]),
        ("[[a]]\n[a]", ["2: 'a' stands in line 1 already"]),
        ("a = []\n[[a]]", ["2: 'a' stands in line 1 already"]),
        ("a.b = 1\n[a]", ["2: 'a' stands in line 1 already"]),
        ("a = 1 2 3", ["1: '1 2' is no value: it is no number", "1: '3' is too much here"]),
        ("a = 1 # \x01", ["1: a comment holds '\\x01'"]),
        ("a = " + "[" * 60 + "]" * 60, ["1: nested deeper than 50"]),
        ("a" + ".a" * 60 + " = 1", ["1: a key of more than 50 parts"]),
        ("a = " + "9" * 5_000, ["1: '" + "9" * 36 + "...' is no value: it is no number"]),
        ("= 1", ["1: a key is expected, not '= 1'"]),
        ("a = b\r\n[c\r\nd = [}]", None),
    ],
)
def test_all_that_is_wrong_is_told_with_its_line(text: str, mistakes: list[str] | None) -> None:
    found = read_toml(text).mistakes
    if mistakes is None:
        assert [line for line, _ in found] == [1, 2, 3]
    else:
        assert [f"{line}: {reason}" for line, reason in found] == mistakes


def test_a_mistake_leaves_the_rest_as_it_is() -> None:
    document = read_toml("a = \n[b]\nc = 1\nd = x\ne = 2\n[[f\ng = 1\n[h]\ni = 1")
    assert document.values == {"a": BROKEN, "b": {"c": 1, "d": BROKEN, "e": 2}, "h": {"i": 1}}
    assert not document.whole


PIECES = ["[", "]", "{", "}", "=", ",", '"', "'", '"""', "'''", "\n", "#", ".", "a", "1", "[a]\n"]
PIECES += ["[[a]]\n", "a = 1\n", "a.b = 2\n", "\\", "\x00", "\r", "true", "-", "[[step]]\n", "é"]


def mutated(text: str, chance: Random) -> str:
    """Return a text with a few pieces put in, taken out or moved."""
    for _ in range(chance.choice([1, 1, 2, 4])):
        at, other = chance.randrange(len(text) + 1), chance.randrange(len(text) + 1)
        piece = chance.choice([chance.choice(PIECES), text[other : other + 20], ""])
        text = text[:at] + piece + text[at + chance.choice([0, 0, 1, 9]) :]
    return text


@pytest.mark.parametrize("seed", range(400))
def test_it_takes_and_refuses_what_the_standard_library_does(seed: int) -> None:
    text = mutated(TEXT, Random(seed))
    document = read_toml(text)
    try:
        wanted = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        assert document.mistakes
    else:
        assert (document.values, document.mistakes) == (wanted, ())


def test_ten_thousand_lines_are_read_in_one_go() -> None:
    text = "".join(f"[device.d{at}]\ntype = 'rrc'\nstart.x = [{at}]\n" for at in range(3_400))
    document = read_toml(text)
    assert document.values == tomllib.loads(text)
    assert document.line_of(("device", "d3399", "start", "x")) == 10_200

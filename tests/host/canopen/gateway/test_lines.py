"""Lines and values of a gateway: read, written, and whatever else may come."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canopen.commissioning.net_bench import NetBench
from tickrig.device import make_epos
from tickrig.host.canopen.gateway import (
    BASE64,
    HEX,
    NUMBERS,
    REALS,
    Gateway,
    GatewayError,
    decode,
    encode,
)

INTEGERS = [name for name in NUMBERS if name not in REALS]
WORDS = st.sampled_from(
    [
        *(
            "[1]",
            "[",
            "]",
            "1",
            "5",
            "0x1000",
            "0",
            "128",
            "r",
            "read",
            "w",
            "set",
            "node",
            "reset",
        ),
        *(
            "comm",
            "u8",
            "vs",
            "hex",
            "d",
            "b",
            '"',
            '""',
            '"a b"',
            "#",
            "-1",
            "0x",
            "start",
            "help",
        ),
        *(
            "lss_get_node",
            "_lss_fastscan",
            "lss_set_node",
            "info",
            "version",
            "\x00",
            "\xe9",
            "1_0",
        ),
        *("9" * 5_000, "\u0661", "1e400", "nan", "sdo_timeout", "AA==", "zz"),
    ]
)


@pytest.fixture(scope="module")
def gateway() -> Gateway:
    bench = NetBench(make_epos(5))
    bench.bus.gather(100_000)
    gateway = Gateway(bench.bus, 1, "1.2")
    gateway.answer("[1] set sdo_timeout 1")
    return gateway


@given(words=st.lists(WORDS | st.text(max_size=5), max_size=9).map(" ".join))
def test_any_line_has_an_answer_of_one_line(gateway: Gateway, words: str) -> None:
    answer = gateway.answer(f"[1] {words}")
    assert "\n" not in answer.replace("\n", " ", 12 if "help" in words.lower() else 0)
    assert answer == "" or answer.startswith("[")


@given(st.sampled_from(INTEGERS), st.data())
def test_an_integer_is_the_same_there_and_back(name: str, data: st.DataObject) -> None:
    lowest, highest = NUMBERS[name].limits
    value = data.draw(st.integers(lowest, highest))
    shown = decode(name, encode(name, [str(value)]))
    assert int(shown, 0) == value
    assert encode(name, [shown]) == encode(name, [hex(value)])


@given(st.sampled_from([*BASE64, HEX]), st.binary(max_size=40))
def test_bytes_are_the_same_there_and_back(name: str, data: bytes) -> None:
    words = decode(name, data).split(" ") if name == HEX else [decode(name, data)]
    assert encode(name, words) == data


@pytest.mark.parametrize(
    ("name", "data", "shown"),
    [
        ("r32", "0000803F", "1"),
        ("r32", "CDCCCC3D", "0.1"),
        ("r64", "000000000000F0BF", "-1"),
        ("r64", "000000000000F87F", "nan"),
        ("vs", "61220D0062", '"a""b"'),
        ("b", "01", "1"),
        ("u32", "0100", "01 00"),
        ("", "", ""),
    ],
)
def test_values_are_shown(name: str, data: str, shown: str) -> None:
    assert decode(name, bytes.fromhex(data)) == shown


@pytest.mark.parametrize("value", ["", "x", "1.5", "0x", "1_0", "\u0661", "--1", "300"])
def test_what_is_no_number_is_refused(value: str) -> None:
    with pytest.raises(GatewayError):
        encode("u8", [value])

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.rrc.samples import SAMPLES
from tickrig.wire.errors import WireError
from tickrig.wire.rrc import commands as cmd


@st.composite
def commands(draw: st.DrawFn) -> cmd.Command:
    kind = draw(st.sampled_from(list(cmd.COMMANDS.values())))
    values = [draw(st.integers(p.low, p.high)) for p in kind.parameters]
    if kind is cmd.Joystick:
        values[0:2] = [draw(st.integers(0, values[2] - 1)) if values[2] else 0, 0]
        values[2], values[3] = max(values[2], 1), max(values[3], 1)
        if values[6] > 1:
            values[7:] = [draw(st.integers(p.low, p.high)) for p in kind.gear_parameters]
    return cmd.Beep(tuple(values)) if kind is cmd.Beep else kind(*values)


@pytest.mark.parametrize(("line", "command"), SAMPLES.items())
def test_the_manuals_samples_are_written_to_the_byte(line: bytes, command: cmd.Command) -> None:
    assert command.encode() == line[:-1] + b"\n"
    assert command.encode(check=True).lower() == line.lower() + b"\n"


@pytest.mark.parametrize(("line", "command"), SAMPLES.items())
def test_the_manuals_samples_are_read(line: bytes, command: cmd.Command) -> None:
    assert cmd.parse_command(line[:-1]) == command


@given(commands())
def test_what_was_written_is_read_back(command: cmd.Command) -> None:
    assert cmd.parse_command(command.encode()[:-1]) == command


begun = st.sampled_from([line[:cut] for line in SAMPLES for cut in (4, -3, -1)])


@given(st.builds(bytes.__add__, begun | st.just(b""), st.binary(max_size=8)))
def test_noise_is_a_wire_error_or_a_command(message: bytes) -> None:
    try:
        command = cmd.parse_command(message)
    except WireError:
        return
    assert command.encode()[:-1].lower() == message.lower()


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (b"output6500", "output: #1 101 is not in -100..100"),
        (b"output0080", "output: #2 -128 is not in -100..100"),
        (b"output1g00", "output: #1 b'1g' is not hexadecimal"),
        (b"output1e", "output: b'1e' is not 4 characters of its grammar"),
        (b"joystick00006464002650000", "joystick: #8 101 is not in 0..100"),
        (b"joystick0000646400305005b", "joystick: #10 91 is not in 0..90"),
        (b"speedmode60", "speedmode: #1 6 is not in 1..5"),
        (b"statusB1", "status: b'B1' is not 2 characters of its grammar"),
        (b"joystick64006464000000000", "joystick: lower dead zone is not below the upper one"),
        (b"joystick00646464000000000", "joystick: lower dead zone is not below the upper one"),
    ],
)
def test_a_bad_parameter_says_what_came_and_what_is_allowed(message: bytes, reason: str) -> None:
    with pytest.raises(cmd.BadParameters) as caught:
        cmd.parse_command(message)
    assert str(caught.value) == reason
    assert message.startswith(caught.value.name)


@pytest.mark.parametrize("message", [b"", b"hello", b"Output1e00", b" output1e00", b"outpu"])
def test_an_unknown_name_is_told_with_all_known(message: bytes) -> None:
    with pytest.raises(cmd.UnknownCommand, match="limit, output, device"):
        cmd.parse_command(message)


def test_a_value_out_of_range_cannot_be_built() -> None:
    with pytest.raises(cmd.BadParameters, match=r"#2 -101 is not in -100\.\.100"):
        cmd.Output(0, -101)


def test_a_beep_has_ten_times() -> None:
    with pytest.raises(cmd.BadParameters, match="9 values, not 10"):
        cmd.Beep((1,) * 9)

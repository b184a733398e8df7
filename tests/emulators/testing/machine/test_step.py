"""Steps are written and read again; what cannot be read is told in a line."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig import Bench
from tickrig.device import make_epos
from tickrig.emulators.testing.machine.host_runs import HostStep, parse_steps

PLAIN = st.one_of(st.integers(), st.text(), st.binary(), st.booleans(), st.none())
CALLS = st.builds(
    HostStep,
    st.integers(0, 10_000_000),
    st.just("call"),
    st.sampled_from(["heat", "write_all"]),
    arguments=st.dictionaries(st.sampled_from(["a", "data"]), PLAIN | st.lists(PLAIN)),
)
OTHERS = st.builds(
    HostStep,
    st.integers(0, 10_000_000),
    st.sampled_from(["press", "fault"]),
    st.sampled_from(["power_button", "kettle/cut", "drop=0.1"]),
    st.sampled_from([0, 1, 999, 20_000, 3_000_000]),
)


@given(st.lists(CALLS | OTHERS))
def test_what_is_written_is_read_again(steps: list[HostStep]) -> None:
    assert list(parse_steps("\n".join(map(str, steps)), "found.txt")) == steps


@pytest.mark.parametrize(
    "devices", [{"axis": "2=epos"}, {"chair": "rrc", "scanner": "urg", "axis": "2=epos"}]
)
def test_each_fault_of_a_bench_is_a_step(devices: dict[str, str]) -> None:
    with Bench(None, **devices) as bench:  # type: ignore[arg-type]  # devices alone
        fresh = bench.snapshot()
        for name, form in bench.describe().faults.items():
            for words in ("", "=rate=0.5,count=1") if form.rated else ("",):
                fresh.restore()
                step = HostStep(1_000, "fault", f"{name}{words}", 100_000)
                assert parse_steps(str(step), "found.txt") == (step,)
                step.do(bench)
                assert f"! {name.rpartition('/')[2]}{words}" in bench.transcript()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("call heat()", "'call heat()' is not '+TIME ACTION ...', as '+5ms call heat()'"),
        ("+5ms heat", "no action 'heat'; known: call, set, press, fault, send, wait, seed"),
        ("+0us seed x", "a seed is a whole number from 0, not 'x'"),
        ("+5ms call heat", "'heat' is not a call, as 'write(data=b\"a\", to=3)'"),
        ("+5ms call heat(3)", "'heat(3)' is not a call, as 'write(data=b\"a\", to=3)'"),
        ("+5ms call a(b=open('x'))", "\"a(b=open('x'))\": an argument is no plain value"),
        ("+5ms call a(b=1", "'a(b=1' is not a call, as 'write(data=b\"a\", to=3)'"),
    ],
)
def test_what_cannot_be_read_is_told(line: str, said: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole text is below
        parse_steps(f"# found\n+0us call on()\n{line}\n", "found.txt")
    assert str(caught.value) == f"found.txt:3: {said}"


def test_each_does_what_it_says() -> None:
    with Bench(left=make_epos(1), panel="rrc") as bench:
        text = """
            +1s press panel/power_button for 50ms
            +400ms set panel/stick 100 0
            +0s fault left/power_off for 1s
            +5ms send panel/64657669636e0a
            +0s send left/701#05
            +50ms wait
        """
        for step in parse_steps(text, "scenario"):
            step.do(bench)
        seen: list[Any] = [bench.get("panel/state"), bench.get("left/state"), bench.now_us]
        assert seen == ["Standby", "Off", 1_455_000]
        assert "panel > devicn" in bench.transcript()
        assert "can < 701#05" in bench.transcript()

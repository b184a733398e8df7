"""A search finds what a host does wrong, as short as can be; it can be done again."""

from __future__ import annotations

import random
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from enum import Enum
from math import inf
from pathlib import Path
from random import Random
from typing import Any, ClassVar

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tickrig import Bench
from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.machine.host_runs import HostRuns, HostStep, parse_steps
from tickrig.host.links.link import Link
from tickrig.testing import (
    BenchMachine,
    check_host,
    fuzz_one_input,
    host_rule,
    invariant,
    replay_host,
    strategies,
)

ROOT = Path(__file__).parents[4]


class Chair(BenchMachine):
    """Asks an RRC, which is on."""

    faults: ClassVar[Sequence[str]] = ("cut",)
    inputs: ClassVar[Sequence[str]] = ("power_button",)
    link: Link[bytes]

    def make_bench(self) -> Bench:
        return Bench("rrc")

    def warm_up(self) -> None:
        self.bench.run_for("1s")
        self.bench.press("power_button")
        self.bench.run_for("1s")

    def connect(self) -> None:
        self.link = self.bench.link
        self.answers: list[bytes] = []

    @host_rule()
    def ask(self) -> None:
        self.link.send(b"device\n")
        self.answers.append(self.link.receive(50_000))

    @host_rule(speed=[10, 20, 30])
    def drive(self, speed: int) -> None:
        self.link.send(b"output%02x00\n" % speed)
        self.link.receive(50_000)


class Trusting(Chair):
    """Believes that each question is answered."""

    @invariant()
    def each_is_answered(self) -> None:
        assert all(self.answers), "a question was not answered"


class Fast(Chair):
    """May not be driven at 30 %."""

    faults = ()

    @invariant()
    def it_is_slow(self) -> None:
        assert int(self.bench.get("out_v_pct")) < 30, "it is too fast"


class Restless(Chair):
    """Asks again and again, and swallows whatever comes of it."""

    longest = "20s"

    @host_rule()
    def ask_for_ever(self) -> None:
        while True:
            try:
                self.ask()
                self.bench.run_for("1s")
            except ValueError:
                continue


class Impatient(Chair):
    """Waits for ever once it was not answered, whatever it is told meanwhile."""

    patience = "2s"

    @host_rule()
    def ask(self) -> None:
        while not self.answers or not self.answers[-1]:
            self.link.send(b"device\n")
            self.answers.append(self.link.receive(50_000))
            if not self.answers[-1]:
                self.bench.run_for("3600s")


class Failing(Chair):
    """Wants it to be ready in the end."""

    def end(self) -> None:
        self.calm()
        self.bench.run_for("2s")
        assert self.bench.get("state") == "Standby", "it is not ready in the end"


def found(machine: type[BenchMachine], max_examples: int = 300) -> tuple[str, str]:
    """Return what a search finds: the exception, and the steps."""
    with pytest.raises(BaseException) as caught:  # noqa: PT011 - what a host may raise
        check_host(machine, max_examples=max_examples)
    note = caught.value.__notes__[-1]
    scenario, _, rest = note.partition("\n\n")
    assert rest.startswith("put it into a file, and: tickrig replay FILE --host ")
    return str(caught.value), scenario


def test_a_host_without_a_mistake_passes() -> None:
    check_host(Chair, max_examples=30)


@pytest.mark.parametrize(
    ("machine", "said", "steps"),
    [
        (Trusting, "a question was not answered", ["fault cut for ", "call ask()"]),
        (Fast, "it is too fast", ["call drive(speed=30)"]),
    ],
)
def test_a_mistake_is_found_and_is_short(
    machine: type[BenchMachine], said: str, steps: list[str]
) -> None:
    text, scenario = found(machine)
    assert text.startswith(said)
    head, *lines, last = scenario.splitlines()
    assert f"test_check_host.py:{machine.__name__}, {len(lines)} step" in head
    assert re.fullmatch(rf"# invariant \w+, at [\d.]+ s: AssertionError: {said}", last)
    assert len(lines) <= 3
    assert all(step in scenario for step in steps)


def test_what_is_found_can_be_done_again(tmp_path: Path) -> None:
    _, scenario = found(Trusting)
    with pytest.raises(AssertionError, match="a question was not answered") as caught:
        replay_host(Trusting, scenario)
    assert "rrc > device" in caught.value.__notes__[-1]
    (tmp_path / "found.txt").write_text(scenario, "utf-8")
    with pytest.raises(AssertionError, match="a question was not answered"):
        replay_host(Trusting, tmp_path / "found.txt")
    replay_host(Chair, scenario)


class Slow(Chair):
    """Must be ready within 2 s, whatever it does."""

    @invariant()
    def it_is_in_time(self) -> None:
        assert self.bench.now_us < 4_000_000, "it takes too long"


class Greedy(Chair):
    """Eats what it is given, and cannot take three at once."""

    faults = inputs = ()

    @host_rule(what=[[1], [1, 2, 3]])
    def eat(self, what: list[int]) -> None:
        eaten = 0
        while what:
            what.pop()
            eaten += 1
        assert eaten < 3, "it cannot eat so much"


class Gear(Enum):
    LOW, HIGH = 1, 2


class Geared(Chair):
    """Takes arguments that Python does not write as they are read."""

    faults = inputs = ()

    @host_rule(gear=list(Gear), limit=[1.0, inf], names=[("#", "\u2028")])
    def shift(self, gear: Gear, limit: float, names: Sequence[str]) -> None:
        assert (gear, limit) != (Gear.HIGH, inf), f"it cannot shift to {names}"


class Gambler(Chair):
    """Goes wrong by chance of its own."""

    faults = inputs = ()

    @host_rule()
    def play(self) -> None:
        assert random.random() < 0.8, "it has lost"


class Quitter(Chair):
    """Ends the program once it was not answered."""

    @host_rule()
    def ask(self) -> None:
        super().ask()
        if not self.answers[-1]:
            sys.exit("no answer")


class Reporting(Trusting):
    """Uses what pytest has for failures."""

    @invariant()
    def each_is_answered(self) -> None:
        if not all(self.answers):
            pytest.fail("a question was not answered")


@pytest.mark.parametrize(
    ("machine", "violated"),
    [
        (Trusting, "invariant each_is_answered"),
        (Fast, "invariant it_is_slow"),
        (Failing, "end"),
        (Slow, "invariant it_is_in_time"),
        (Greedy, "rule eat"),
        (Geared, "rule shift"),
        (Gambler, "rule play"),
        (Quitter, "rule ask"),
        (Reporting, "invariant each_is_answered"),
    ],
)
def test_no_step_of_what_is_found_can_be_left_out(
    machine: type[BenchMachine], violated: str
) -> None:
    _, scenario = found(machine)
    head, *steps, last = scenario.splitlines()
    assert last.startswith(f"# {violated}, at ")
    assert failure_of(machine, scenario) == last
    assert steps
    for number in range(len(steps)):
        left = [head, *steps[:number], *steps[number + 1 :], ""]
        assert failure_of(machine, "\n".join(left)) != last, steps[number]


def failure_of(machine: type[BenchMachine], scenario: str) -> str:
    """Return what is wrong in a replay, as the scenario says it."""
    random.seed()  # a replay seeds itself
    try:
        replay_host(machine, scenario)
    except BaseException as error:
        return "# " + error.__notes__[-1].partition("\n")[0]
    return ""


def test_chance_of_numpy_is_the_same_in_each_run_and_is_given_back() -> None:
    drawn = []

    class Noting(Chair):
        faults = inputs = ()

        @host_rule()
        def ask(self) -> None:
            drawn.append((random.random(), np.random.random()))

    np.random.seed(3)
    for _ in range(2):
        replay_host(Noting, "+0us call ask()\n+0us call ask()\n")
    after = np.random.random()
    assert drawn[:2] == drawn[2:]
    assert drawn[0] != drawn[1]
    assert after == np.random.RandomState(3).random()


def test_an_assumption_that_does_not_hold_is_no_failure() -> None:
    class Assuming(Chair):
        faults = inputs = ()

        @host_rule(speed=[10, 20, 30])
        def drive(self, speed: int) -> None:
            assume(speed != 30)
            assert speed != 20, "it is too fast"

    text, scenario = found(Assuming)
    assert text.startswith("it is too fast")
    assert "call drive(speed=20)" in scenario


def test_an_action_that_does_not_come_is_no_step() -> None:
    _, scenario = found(Slow)
    assert re.fullmatch(r"\+\S+ wait", scenario.splitlines()[1])


def test_what_follows_a_failure_is_no_step() -> None:
    text = "+1s call drive(speed=30)\n+1s call ask()\n+1s call ask()\n"
    steps = parse_steps(text, "found.txt")
    with HostRuns(Fast) as runs:
        with pytest.raises(AssertionError, match="it is too fast"):
            runs.run(steps)
        assert runs.failure is not None
        assert runs.failure.steps == steps[:1]


def test_a_value_that_a_scenario_cannot_hold_is_refused() -> None:
    class Odd(Chair):
        @host_rule(what=[object()])
        def take(self, what: object) -> None:
            raise NotImplementedError

    class Drawn(Chair):
        @host_rule(gear=st.sampled_from(Gear))
        def take(self, gear: Gear) -> None:
            raise NotImplementedError

    for machine, said in ((Odd, "take: what=<object"), (Drawn, "take: gear=<Gear.LOW: 1>")):
        with pytest.raises(TypeError, match=f"{said}.* cannot be written in a scenario; draw"):
            check_host(machine, seed=1)


@given(st.floats() | st.binary(max_size=40) | st.sets(st.integers()))
def test_a_value_that_is_drawn_is_read_again(value: Any) -> None:
    step = HostStep(0, "call", "take", arguments={"what": value})
    (read,) = parse_steps(str(step), "found.txt")
    assert read == step or str(read) == str(step)  # nan differs from itself


def test_a_run_that_does_not_fail_again_is_told() -> None:
    class Forgetful(Chair):
        faults = inputs = ()
        asked: ClassVar[list[int]] = []

        @host_rule()
        def ask(self) -> None:
            self.asked.append(1)
            assert len(self.asked) != 5, "the fifth question of all"

    text, scenario = found(Forgetful)
    assert text.startswith("the fifth question of all")
    assert "# it passed when it was repeated: the host keeps something" in scenario


def test_a_strategy_that_raises_is_not_told_as_a_run() -> None:
    def broken(number: int) -> int:
        raise ZeroDivisionError(number)

    class Broken(Chair):
        @host_rule(what=st.integers().map(broken))
        def take(self, what: int) -> None:
            raise NotImplementedError

    with pytest.raises(ZeroDivisionError) as caught:
        check_host(Broken, seed=1)
    assert not any("a scenario of" in note for note in getattr(caught.value, "__notes__", ()))


def test_a_fault_may_be_named_with_its_arguments() -> None:
    seen: set[str] = set()

    class Watched(Noisy):
        faults = ("delay=30ms", "truncate=1,rate=0.5", "drop=way=answer")

        def end(self) -> None:
            lines = self.bench.transcript().splitlines()
            seen.update(line.split(" ! ")[1] for line in lines if " ! " in line)

    check_host(Watched, max_examples=60, seed=1)
    assert {"delay=30ms", "delay=30ms,rate=0.1", "truncate=1,rate=0.5"} <= seen
    assert {"drop=way=answer,0.1", "drop=way=answer"} & seen
    assert not any(each.startswith("truncate=1,rate=0.5,") for each in seen)

    class Wrong(Noisy):
        faults = ("delay=30",)

    with pytest.raises(ValueError, match="delay: time: '30' has no unit"):
        check_host(Wrong)


def test_noise_without_a_rate_differs_from_run_to_run() -> None:
    seeds = set()

    class Watched(Noisy):
        faults = ("garbage",)

        def end(self) -> None:
            if "garbage" in self.bench.transcript():
                seeds.add(self.bench.transcript())

    check_host(Watched, max_examples=60, seed=1)
    assert len(seeds) > 10


def test_a_command_does_it_again_without_hypothesis(tmp_path: Path) -> None:
    (tmp_path / "chair.py").write_text(CHAIR, "utf-8")
    (tmp_path / "found.txt").write_text("+0us call drive(speed=30)\n", "utf-8")
    (tmp_path / "fine.txt").write_text("+0us call drive(speed=20)\n", "utf-8")
    program = "import sys; sys.modules['hypothesis'] = None\n"
    program += "from tickrig.commands import tickrig; tickrig()"
    said = {}
    for name in ("found", "fine"):
        done = subprocess.run(
            [sys.executable, "-c", program, "replay", f"{name}.txt", "--host", "chair.py:Chair"],
            cwd=tmp_path,
            env={"PYTHONPATH": str(ROOT / "src")},
            capture_output=True,
            text=True,
            check=False,
        )
        said[name] = done.returncode, done.stdout.splitlines()[0] if done.stdout else done.stderr
    assert said == {
        "found": (1, "AssertionError: it is too fast"),
        "fine": (0, "nothing is wrong in 1 step"),
    }


CHAIR = """
from tickrig import Bench
from tickrig.testing import BenchMachine, host_rule


class Chair(BenchMachine):
    def make_bench(self):
        return Bench("rrc")

    @host_rule(speed=[10, 20, 30])
    def drive(self, speed):
        assert speed < 30, "it is too fast"
"""


@pytest.mark.parametrize(
    ("scenario", "host", "said"),
    [
        (
            "+0us call drive(speed=1)\n",
            "chair.py:Bike",
            "chair.py has no BenchMachine 'Bike'; it has Chair",
        ),
        ("nothing\n", "chair.py:Chair", "found.txt:1: 'nothing' is not '+TIME ACTION"),
        (None, "chair.py:Chair", "found.txt"),
    ],
)
def test_a_call_that_cannot_be_is_told_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scenario: str | None, host: str, said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("chair.py").write_text(CHAIR, "utf-8")
    if scenario:
        Path("found.txt").write_text(scenario, "utf-8")
    result = CliRunner().invoke(main, ["replay", "found.txt", "--host", host])
    assert (result.exit_code, result.output.count("\n")) == (2, 1)
    assert said in result.output


def test_a_scenario_without_its_host_is_told_what_replays_it(tmp_path: Path) -> None:
    for head in ("", "# a scenario of chair.py:Chair, 1 step\n"):
        found = tmp_path / "found.txt"
        found.write_text(f"{head}+0us call drive(speed=1)\n", "utf-8")
        result = CliRunner().invoke(main, ["replay", str(found)])
        assert result.exit_code == 2
        assert "is a scenario of check_host: --host FILE.py:Class replays it" in result.output


def test_a_host_that_does_not_come_back_is_found() -> None:
    with pytest.raises(AssertionError, match="the run does not end within 20s"):
        replay_host(Restless, "+0us call ask_for_ever()\n")
    text, scenario = found(Impatient)
    assert text.startswith("the host does not come back within 2s")
    assert len(scenario.splitlines()) <= 4


def test_a_host_that_waits_while_nothing_happens_is_found() -> None:
    class Quiet(BenchMachine):
        patience = "3s"

        def make_bench(self) -> Bench:
            return Bench("rrc")

        @host_rule()
        def listen(self) -> None:
            with self.bench.serial(timeout=None) as port:
                port.read(1)

    with pytest.raises(AssertionError, match="the host does not come back within 3s"):
        replay_host(Quiet, "+0us fault cut for 3600s\n+0us call listen()\n")


class Hasty(Chair):
    """Drives without waiting for anything."""

    @host_rule(speed=[10, 20, 30])
    def drive(self, speed: int) -> None:
        self.link.send(b"output%02x00\n" % speed)

    @invariant()
    def it_is_slow(self) -> None:
        assert int(self.bench.get("out_v_pct")) < 30, "it is too fast"


def test_a_run_is_judged_when_its_last_step_has_come_to_the_device() -> None:
    replay_host(Hasty, "+0us call drive(speed=20)\n")
    with pytest.raises(AssertionError, match="it is too fast"):
        replay_host(Hasty, "+0us call drive(speed=30)\n")


def test_the_host_of_a_run_hears_nothing_of_the_warm_up() -> None:
    class Listening(Chair):
        def connect(self) -> None:
            super().connect()
            heard = self.link.receive(0)
            assert heard == b"", f"it hears {heard!r}"

    replay_host(Listening, "+0us wait\n+0us call ask()\n")


def test_a_seed_is_the_same_search_again() -> None:
    def drawn() -> list[list[str]]:
        runs: list[list[str]] = []

        class Noted(Chair):
            @host_rule()
            def note(self) -> None:
                runs[-1].append(f"{self.bench.now_us}")

            def connect(self) -> None:
                super().connect()
                runs.append([])

        check_host(Noted, max_examples=20, seed=3)
        return runs

    first = drawn()
    assert drawn() == first
    assert any(first)


def test_the_end_is_judged_after_calm() -> None:
    replay_host(Failing, "+0us fault cut for 3s\n+0us call ask()\n")
    with pytest.raises(AssertionError, match="it is not ready in the end"):
        replay_host(Failing, "+0us fault bus_unplugged for 1s\n+500ms wait\n")


@pytest.mark.parametrize(
    ("scenario", "said"),
    [
        ("+0us call drift()\n", "no rule 'drift'; did you mean 'drive'"),
        ("+0us call drive(fast=1)\n", r"drive takes \(speed\), got \+0us call drive\(fast=1\)"),
        ("+0us fault cot\n", "no fault 'cot'; did you mean 'cut'"),
    ],
)
def test_a_scenario_of_another_machine_is_refused(scenario: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        replay_host(Chair, scenario)


def test_a_machine_that_cannot_be_is_refused() -> None:
    class Misspelt(Chair):
        faults = ("cot",)

    class Odd(Chair):
        @host_rule(speed=5)
        def go(self, speed: int) -> None:
            raise NotImplementedError

    class Empty(BenchMachine):
        def make_bench(self) -> Bench:
            return Bench("rrc")

    with pytest.raises(ValueError, match="no fault 'cot'; did you mean 'cut'"):
        check_host(Misspelt)
    with pytest.raises(TypeError, match="5 says not what an argument may be"):
        check_host(Odd)
    with pytest.raises(ValueError, match="Empty has no host_rule"):
        check_host(Empty)
    with pytest.raises(NotImplementedError, match="BenchMachine makes no bench: write make_bench"):
        check_host(BenchMachine)


def test_mistakes_in_a_machine_are_told_in_a_line() -> None:
    class Rated(Chair):
        faults = ("flip=0.01",)

    class Bare(Chair):
        faults = "cut"

    class Short(Chair):
        fault_for = "300ms"

    class Forgot(Chair):
        def make_bench(self) -> Bench:
            return None  # type: ignore[return-value]  # the mistake

    with pytest.raises(ValueError, match="the search draws rates, so name 'flip'"):
        check_host(Rated)
    with pytest.raises(ValueError, match="faults is a tuple of names"):
        check_host(Bare)
    with pytest.raises(ValueError, match="fault_for is a tuple of times"):
        check_host(Short)
    with pytest.raises(TypeError, match="make_bench returned None, no Bench"):
        check_host(Forgot)
    with pytest.raises(TypeError, match="give the class Chair, not an object of it"):
        check_host(Chair())  # type: ignore[arg-type]  # the mistake


class Noisy(Chair):
    """Notes what the device hears of a question on a noisy line."""

    faults: ClassVar[Sequence[str]] = ("flip",)
    inputs = ()
    heard: ClassVar[list[str]] = []

    def end(self) -> None:
        lines = self.bench.transcript().splitlines()
        self.heard.append("".join(line for line in lines if " ~ " in line))


def test_a_seed_in_a_scenario_is_other_noise_and_the_same_each_time() -> None:
    Noisy.heard.clear()
    asked = "+0us fault flip=0.02 for 3s\n" + "+0us call ask()\n" * 8
    for head in ("", "+0us seed 1\n", "+0us seed 2\n", "+0us seed 1\n"):
        replay_host(Noisy, head + asked)
    bare, one, two, again = Noisy.heard
    assert one == again
    assert len({bare, one, two}) == 3


def test_a_search_draws_seldom_noise_and_other_noise_in_each_run() -> None:
    seen: set[str] = set()

    class Watched(Noisy):
        def end(self) -> None:
            seen.update(
                line.split(" ! ")[1]
                for line in self.bench.transcript().splitlines()
                if " ! flip=" in line
            )
            super().end()

    Noisy.heard.clear()
    check_host(Watched, max_examples=150, seed=1)
    assert {"flip=0.0003", "flip=0.003"} <= {each.split()[0] for each in seen}
    assert len(set(Noisy.heard)) > 30


def test_without_hypothesis_it_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    said = r"a search wants Hypothesis: pip install 'tickrig\[test\]'"
    for use in (check_host, fuzz_one_input):
        with pytest.raises(ModuleNotFoundError, match=said):
            use(Chair)


def test_bytes_are_runs_too(capsys: pytest.CaptureFixture[str]) -> None:
    one_input: Callable[[bytes], None] = fuzz_one_input(Fast)

    def throw() -> None:
        for number in range(1_000):
            one_input(Random(number).randbytes(300))

    with pytest.raises(AssertionError, match="it is too fast") as caught:
        throw()
    assert ", 1 step\n" in caught.value.__notes__[-1]  # no other can be left out
    assert "call drive(speed=30)" in caught.value.__notes__[-1]
    assert capsys.readouterr().err == caught.value.__notes__[-1] + "\n"


def test_strategies_draw_what_a_bench_has() -> None:
    with Bench("rrc") as bench:
        hands = strategies.operator(bench, ["stick_v_pct", "power_button"])
        steps = strategies.faults(bench) | hands | strategies.traffic(["6f6b0a"])
        fresh = bench.snapshot()
        verbs = set()

        @settings(max_examples=30)
        @given(st.lists(steps, max_size=5))
        def do(drawn: list[HostStep]) -> None:
            fresh.restore()
            for step in drawn:
                step.do(bench)
                verbs.add(step.verb)

        do()
    assert verbs == {"fault", "press", "set", "send"}

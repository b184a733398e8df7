"""Random dialogues, played against the device and the naive model, byte for byte.

More of them: `python -m tests.device.rtc_lite.test_against_reference 100000`.
"""

from __future__ import annotations

import random
import sys

import pytest

from tests.device.rtc_lite.bench import NodeBench, Recorder
from tests.device.rtc_lite.reference_model import NO_ARGUMENTS, ReferenceNode, checked
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.wire.rtc_lite.codes import LiteContextType

pytestmark = pytest.mark.unmeasured

CALLBACKS = (
    *("on_initialize", "on_finalize", "on_startup", "on_shutdown", "on_activated"),
    *("on_deactivated", "on_execute", "on_aborting", "on_error", "on_reset"),
)
LIKELY = ["CI", "AA", "AA", "AE", "AE", "AE", "AD", "AR", "AC", "AB", "CX"]
NAMES = [b"in", b"in", b"in", b"out", b"", b"inn", bytes(16)]
WAITS_MS = [1, 1, 1, 1, 2, 7, 19, 20, 21, 99, 100, 101, 400]

Act = tuple[int, bytes, set[str] | None]
"""Ticks to wait, bytes to send, and the callbacks that fail from now on."""


def request(chance: random.Random) -> bytes:
    kind = chance.randrange(10)
    if kind < 5:
        return checked(chance.choice(LIKELY))
    if kind < 6:
        return checked(chance.choice(sorted(NO_ARGUMENTS - {"CF"})))
    if kind < 8:
        name, size = chance.choice(NAMES), chance.choice([4, 4, 4, 4, 0, 3, 5, 40])
        return checked("PS", bytes([len(name), size]) + name + chance.randbytes(size))
    name = chance.choice([b"out", b"out", b"in"])
    rate_hz = chance.choice([0, 1, 7, 300, 1000, 1001])
    rare = {
        "CY": chance.randbytes(1),
        "BW": rate_hz.to_bytes(2, "little"),
        "QG": bytes([len(name)]) + name,
        "CF": b"",
    }
    return checked(*chance.choice(list(rare.items())))


def damaged(chance: random.Random, data: bytes) -> bytes:
    at = chance.randrange(len(data))
    match chance.randrange(4):
        case 0:
            return data[:at]
        case 1:
            return data[:at] + chance.randbytes(1) + data[at + 1 :]
        case 2:
            return data + data
        case _:
            return chance.randbytes(chance.randrange(1, 9)) + data


def session(chance: random.Random, length: int) -> list[Act]:
    acts = list[Act]()
    for _ in range(length):
        data = request(chance)
        data = damaged(chance, data) if chance.random() < 0.15 else data
        failing = set(chance.sample(CALLBACKS, chance.choice([0, 0, 1, 3])))
        change = chance.random() < 0.1
        if chance.random() < 0.2:  # in two parts
            at = chance.randrange(len(data) + 1)
            acts.append((chance.choice(WAITS_MS), data[:at], None))
            data = data[at:]
        acts.append((chance.choice(WAITS_MS), data, failing if change else None))
    return acts


def play(seed: int, length: int = 60) -> int:
    """Play a session on both; return how many bytes they said."""
    chance = random.Random(seed)
    timer_hz = chance.choice([0, 0, 3, 10, 400, 1000])
    context = LiteContextType.TIMER if timer_hz else LiteContextType.PROXY
    bench = NodeBench(Recorder, LiteConfig(context=context, rate_hz=timer_hz or 10))
    model, said = ReferenceNode(timer_hz), 0
    for number, (ticks, data, failing) in enumerate(session(chance, length)):
        for tick in range(ticks):
            sent = bench.push(data if tick == 0 else b"")
            expected = model.tick(bench.now_us, data if tick == 0 else b"")
            place = f"seed {seed}, act {number}, {bench.now_us} us, {data.hex(' ')}"
            assert sent.hex(" ") == expected.hex(" "), place
            assert bench.state[0] == model.state, place
            assert bench.recorder.called == model.called, place
            said += len(sent)
        if failing is not None:
            bench.recorder.failing, model.failing = failing, failing
    return said


@pytest.mark.parametrize("seed", range(60))
def test_a_random_dialogue_goes_as_the_model_says(seed: int) -> None:
    assert play(seed) > 100


if __name__ == "__main__":
    print(sum(play(seed) for seed in range(int(sys.argv[1]))), "bytes were the same")

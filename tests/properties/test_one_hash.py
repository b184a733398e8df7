"""One hash over what every device does: each Python and each build has the same.

`python -m tests.properties.test_one_hash` prints the hash of each part, and that of all. What sine
and cosine return is up to the C library, which has other instructions for other processors.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import atan2, cos, exp, expm1, isfinite, sin
from typing import Any, Final

import pytest

from tests.device.servo.test_rest import Event, play
from tests.import_graph import modules
from tests.properties import (
    test_canopen_determinism,
    test_rrc_determinism,
    test_rtc_lite_determinism,
)
from tests.properties.test_devices import (
    CAN_FRAMES,
    KINDS,
    LITE_FRAMES,
    RH3_ORDERS,
    RRC_LINES,
    URG_LINES,
    WithInputs,
)
from tests.test_compiled import history
from tickrig.device.body import BodyParameters, OmniBody, Velocity, WheeledBody
from tickrig.device.chance import Chance
from tickrig.device.physical import InputSignal, SignalType
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.servo.parameters import PRESETS
from tickrig.device.ucode_reader import UcodeReader
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, World
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties.device_bench import DeviceBench
from tickrig.emulators.testing.properties.strategies import Act
from tickrig.host.rtc.motion.drive import drive, start
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.wire.can import CanFrame
from tickrig.wire.modbus import encode_frame, encode_request

ONE_HASH: Final = "1d4d2cd397dd0d59807f202bbf6953ba183f4bc4c2754f43577c64f59c8312e5"
"""Renew it where a device is meant to do something else than before."""

LIBM: Final = "574a9963050bcfdf2120e6d203e0430883376a31cfa780fdc74e39ea730c6536"
"""The hash of what glibc 2.36 returns on a processor with FMA."""

WORDS: Final[Mapping[type, Sequence[Any]]] = {
    Rrc: RRC_LINES,
    RtcLiteNode: LITE_FRAMES,
    Rh3Base: [encode_frame(1, encode_request(order)) for order in RH3_ORDERS],
    Urg: [f"{line}\n".encode() for line in URG_LINES],
    UcodeReader: [b"ID\n", b"ON\n", b"OFF\r\n", b"X\n"],
    WithInputs: [(CanFrame.parse(text),) for text in CAN_FRAMES if "605#" in text],
}
"""What a host says to each type of device; first all of it in turn, then by chance."""

WAITS_US: Final = (1, 999, 5_000, 10_001, 100_000, 310_000)
ACTS: Final = 60


def written(value: object) -> str:
    """Write an observation: numbers to the last bit, and alike as `int`, `float` and `bool`."""
    match value:
        case tuple() | list():
            return f"[{' '.join(map(written, value))}]"
        case bytes():
            return value.hex()
        case int() | float():
            return float(value).hex()
    return str(value)


def hash_of(observations: object) -> str:
    return hashlib.sha256(written(observations).encode()).hexdigest()


def changed(items: Sequence[InputSignal], chance: Chance) -> tuple[str, float]:
    """Choose an input and a value: an end of its range, 0 or 1, or one between the ends."""
    item = items[chance.draw() % len(items)]
    low, high = item.low, item.high
    values = [value for value in (low, high, 0, 1) if low <= value <= high and isfinite(value)]
    if isfinite(high - low):
        values += [low + (high - low) * (chance.draw() % 101 / 100)] * 4
    value = values[chance.draw() % len(values)]
    return item.name, value if item.real else int(value)


def session(device: Any, words: Sequence[Any], chance: Chance) -> Iterator[Act]:
    table = device.inputs.table.values() if hasattr(device, "inputs") else ()
    items = [item for item in table if item.type is not SignalType.TEXT]
    yield from ((5_000, "send", word) for word in words)
    for _ in range(ACTS):
        wait_us = WAITS_US[chance.draw() % len(WAITS_US)]
        lot = chance.draw() % 40
        if lot == 0:
            yield wait_us, "reset", None
        elif lot < 12 and items:
            yield wait_us, "set", changed(items, chance)
        else:
            yield wait_us, "send", words[chance.draw() % len(words)]


def played(name: str) -> str:
    """Play a session to a kind of device; hash all that was seen of it."""
    kind = {"wire": SerialLine, "start": (), **KINDS[name]}
    bench = DeviceBench(kind["device_type"], kind["wire"], kind["start"])
    words = WORDS[type(bench.device)]
    return hash_of(bench.play([*session(bench.device, words, Chance(1, name))]))


def bodies() -> str:
    """Let bodies roll; hash where they are."""
    omni, seen = OmniBody(), list[object]()
    skid = WheeledBody(
        BodyParameters(
            kind="skid-steer", wheel_radius_m=0.1, tread_m=0.5, mass_kg=9.0, friction=0.4
        )
    )
    for at_ms in range(3_000):
        omni.step(Velocity(0.3 * sin(at_ms / 700), 0.1, 0.4))
        angles = enumerate(skid.contacts, 2)
        skid.step({name: sin(at_ms / 400 / place) for place, name in angles})
        seen += [(body.pose.x_m, body.pose.y_m, body.pose.heading_rad) for body in (omni, skid)]
    return hash_of(seen)


SCRIPT: Final[list[Event]] = [
    *((20, ("drive_position", 3_000)), (400, ("load_nm", -1.5)), (900, ("drive_velocity", -9_000))),
    *((700, ("load_kg_m2", 0.03)), (300, ("drive_current", 4.5)), (350, ("blocked", True))),
    *((900, ("ambient_c", 41.5)), (10, ("blocked", False)), (150, ("supply_v", 21.3))),
    *((10, ("drive_position", 2_500)), (90_000, ("load_nm", 0.7)), (10, ("release",))),
]
"""What drive and world do to a servo, and how many milliseconds after the event before."""


def servos() -> str:
    """Let a script happen to each servo that is shipped; hash what is seen of it, to the bit."""
    return hash_of([play(parameters, SCRIPT, dense=False) for parameters in PRESETS.values()])


def cart() -> str:
    """Drive a cart round a post that its range finder sees; hash where it was, and its scans."""
    loop = ClosedLoop(
        BaseParameters(noise=0.02, friction=0.5), world=World(posts=(Post(1, 1, 0.2),))
    )
    eye = loop.range_finders[0]
    eye.line.b.send(0, b"SCIP2.0\nBM\n")
    start(loop, "tuned")
    eye.line.b.send(loop.now_us, b"MS0384050002000\n")
    run = drive(loop, [Pose(0.5), Pose(0.5, 0.5)])
    where = [(s.pose.x, s.pose.y, s.pose.heading, s.twist.v, s.twist.w) for s in run.samples]
    scans = eye.line.b.poll(loop.now_us)
    assert len(scans) > 1_000
    return hash_of((where, scans, run.turning_rad_s, run.cross_track.rms))


PARTS: Final[Mapping[str, Callable[[], str]]] = {
    **{name: partial(played, name) for name in KINDS},
    "two drives": partial(history, 2),
    "127 slaves": test_canopen_determinism.network,
    "two RRCs": partial(test_rrc_determinism.crosstalk, 0),
    "two RTC-Lite nodes": lambda: hash_of(test_rtc_lite_determinism.chain(0)),
    "servos": servos,
    "bodies": bodies,
    "cart": cart,
}


def hashes() -> dict[str, str]:
    """Return the hash of each part."""
    return {name: part() for name, part in PARTS.items()}


def one_hash(parts: Mapping[str, str]) -> str:
    return hashlib.sha256("\n".join(f"{n} {h}" for n, h in parts.items()).encode()).hexdigest()


def lines(parts: Mapping[str, str]) -> str:
    return "\n".join(f"{value[:16]}  {name}" for name, value in parts.items())


def libm() -> str:
    """Return a hash over functions of the C library that devices call."""
    args = [number * 0.37 for number in range(-5_000, 5_000)]
    seen = [(sin(x), cos(x), atan2(x, 3.0), exp(x / 100), expm1(x / 100)) for x in args]
    return hash_of(seen)


def test_each_python_and_each_build_has_one_hash() -> None:
    if (found := libm()) != LIBM:
        pytest.skip(f"this C library, or processor, has another sine: {found}")
    parts = hashes()
    assert one_hash(parts) == ONE_HASH, lines(parts)


def unsafe_sums(source: str) -> list[int]:
    """Return the lines where `sum` may add floats: Python 3.12 and later add what was rounded off.

    The sum is an integer where the form of each element says so (`1 << bit`, `len(x)`, `a in b`),
    or where the type checker demands one: in `name: int = sum(...)`, in what a function that is
    `-> int` returns, and below `&`, `|`, `^`, `<<`, `>>`.
    """
    tree = ast.parse(source)
    inside: dict[ast.AST, ast.AST] = {
        child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)
    }
    uses = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id == "sum"]
    return [use.lineno for use in uses if not _adds_integers(use, inside)]


BITWISE: Final = (ast.BitAnd, ast.BitOr, ast.BitXor, ast.LShift, ast.RShift)


def _adds_integers(use: ast.Name, inside: Mapping[ast.AST, ast.AST]) -> bool:
    call = inside[use]
    if not isinstance(call, ast.Call) or call.func is not use:
        return False
    match call.args:
        case [ast.GeneratorExp(elt=element)] if _is_integer(element):
            return True
    node: ast.AST = call
    while isinstance(node := inside[node], ast.BinOp):
        if isinstance(node.op, BITWISE):
            return True
    if isinstance(node, ast.Return):
        while not isinstance(node := inside[node], ast.FunctionDef):
            pass
        return _is_int(node.returns)
    return isinstance(node, ast.AnnAssign) and _is_int(node.annotation)


def _is_integer(element: ast.expr) -> bool:
    match element:
        case ast.Compare() | ast.UnaryOp(op=ast.Not()):
            return True
        case ast.BinOp(op=operator):
            return isinstance(operator, BITWISE)
        case ast.Call(func=ast.Name(id="len" | "any" | "all" | "bool")):
            return True
    return False


def _is_int(annotation: ast.expr | None) -> bool:
    return isinstance(annotation, ast.Name) and annotation.id == "int"


@pytest.mark.parametrize(
    "source",
    [
        *("x = sum(values)", "x = sum(map(mul, a, b))", "x = map(sum, rows)", "add = sum"),
        *("x = sum(a * b for a, b in c) & 1 if d else sum(c)", "x = sum(e for e in c) + 1"),
        *("def f() -> float:\n return sum(c)", "def f() -> int:\n return round(sum(c))"),
        *("x: float = sum(c)", "x: int = round(sum(c))", "x = y if sum(c) > 1 else z"),
    ],
)
def test_sums_that_may_be_of_floats_are_found(source: str) -> None:
    assert len(unsafe_sums(source)) == 1


@pytest.mark.parametrize(
    "source",
    [
        *("x = 2 + sum(data) & 0xFF", "x = sum(len(a) for a in b)", "x = sum(a is b for a in c)"),
        *("def f() -> int:\n return 8 * sum(c) - 1", "x: int = sum(c)", "x = a.sum()"),
    ],
)
def test_sums_of_integers_are_let_through(source: str) -> None:
    assert unsafe_sums(source) == []


EXACT: Final = (
    "tickrig.wire",
    "tickrig.device",
    "tickrig.host.rtc.motion",
    "tickrig.emulators.rig",
)
"""Where numbers come from that reach traces."""


def test_no_float_is_added_by_the_built_in_sum() -> None:
    """`functools.reduce(operator.add, values, 0.0)` rounds each time; `math.fsum` once."""
    found = [
        f"{name}:{line}"
        for name, path in modules().items()
        if name.startswith(EXACT)
        for line in unsafe_sums(path.read_text("utf-8"))
    ]
    assert found == []


def test_no_protocol_is_asked_for_by_isinstance() -> None:
    """Since Python 3.12 `isinstance` ignores `__getattr__` there: a wrapper is something else."""
    assert [
        n for n, path in modules().items() if "runtime_checkable" in path.read_text("utf-8")
    ] == []


if __name__ == "__main__":
    made = hashes()
    print(lines(made))
    print(one_hash(made))

"""Mutated calls of `canmon net` and `canmon gateway`: words, DCF, bus.yml and lines."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from random import Random
from typing import Final

import pytest
from click.testing import CliRunner

from tests.mutators import spoilt
from tickrig.device import make_epos
from tickrig.device.canopen.models.f_palette_boot import make_f_palette_boot
from tickrig.emulators.testing.conformance.conformance import SlaveBench
from tickrig.host.canmon import gateway as gateway_verb
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.net import session
from tickrig.wire.canopen.eds.eds_writer import write_dcf

STATUSES = (0, 1, 2, 3)
LINES = (
    "read 5 statusword 1018h:1 0x6041 6064sub0",
    "read 5 --json",
    "write 5 controlword=6 target_velocity=-100 1017h=u16:0x1F",
    "write 5 2000h:1=text:left 1018h:1=f32:1.5 6060=hex:01",
    "nmt start 5",
    "nmt reset-comm all",
    "lss --identity 0:6210:10000:1 --node-id 7 --bit-rate 500k --dry-run",
    "lss --only-node --store --activate 200ms --bit-rate 1M",
    "compare 5 {file}",
    "compare 5 5",
    "dcf 5 {file} --skip 1017h --all",
    "dcf 5 {file} --other-device",
    "store 5 all",
    "restore 5 communication --reset",
    "program 5 {file} --expect 1A2B3C4D --number 1",
    "program 5 --control stop",
    "boot 5 --eds {file} --explain",
    "boot 5 --bus {file} --keep-alive",
    "boot 5 --eds {file} --steps",
    "write 5 heartbeat_time=100 6040h=6 --dry-run",
    "scan --wait 10ms --json",
)
WORDS = (
    *("", "-1", "0", "5", "127", "128", "255", "1e9", "nan", "inf", "0x", "h", ":", "=", "--", "-"),
    *("\x1b[2J", "\udc80", "é", "all", "6041h:FFF", "1018h:", "u64:-1", "bool:2", "f32:1e99", "@"),
)
BUS = b"""\
master: {node_id: 1}
defaults: {dcf: nosuch.eds, heartbeat_producer: 100}
nodes:
  left: {node_id: 5, sdo: [{index: 0x6098, value: 35}]}
"""


LINES_OF_GATEWAY: Final = """\
[1] 5 read 0x1008 0 vs
[2] 1 5 r 0x1018 1 x32
[3] 5 w 0x607A 0 i32 -16
[4] 5 w 0x1010 1 vs save
[5] set sdo_timeout 20
[6] set node 5
[7] r 0x1017 0
[8] 5 start
[9] reset comm
[10] lss_switch_glob 1
[11] lss_set_node 7
[12] _lss_fastscan 10
[13] lss_switch_sel 0 6210 10000 1
[14] info version
[15] help
"""
DEVICES: Final = {"epos": make_epos, "f_palette_boot": make_f_palette_boot}


@cache
def _dcf() -> bytes:
    entries = make_epos(5).dictionary.description
    values = {entry.key: entry.power_on_data(5) for entry in entries}
    return write_dcf(entries, 5, 1_000_000, values).encode()


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return a call: its device, words, file and standard input, as JSON."""
    device = chance.choice(("epos", "epos", "f_palette_boot"))
    call: dict[str, object] = {"device": device, "file": "", "input": ""}
    if chance.random() < 0.1:
        call["words"] = ["gateway"]
        call["input"] = spoilt(LINES_OF_GATEWAY.encode(), chance).decode("latin-1")
        return "call.json", json.dumps(call).encode()
    text = BUS if chance.random() < 0.2 else _dcf()
    call["file"] = (spoilt(text, chance) if chance.random() < 0.8 else b"\0" * 99).decode("latin-1")
    words = chance.choice(LINES).split()
    for _ in range(chance.randint(0, 2)):
        _mutate(words, chance)
    call["words"] = ["net", *words]
    return "call.json", json.dumps(call).encode()


def judge(_name: str, data: bytes) -> str:
    """Make a call; its exit status in a word. AssertionError if it ends otherwise than it may."""
    call = json.loads(data)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        path.write_bytes(call["file"].encode("latin-1"))
        verb, *rest = (word.replace("{file}", str(path)) for word in call["words"])
        with _on(SlaveBench(DEVICES[call["device"]](5), 1_000_000)):
            result = CliRunner().invoke(
                main,
                [verb, "its-bus", *rest],
                catch_exceptions=False,
                input=call["input"].encode("latin-1"),
            )
    assert result.exit_code in STATUSES, result.stderr
    lines = [line for line in result.stderr.splitlines() if line.startswith("Error:")]
    assert len(lines) == bool(result.exit_code) or result.exit_code < 2, result.stderr
    return f"{verb} {result.exit_code}"


def _mutate(words: list[str], chance: Random) -> None:
    """Change a word: another one, a part of it, one more or one less."""
    at = chance.randrange(len(words))
    word = words[at]
    match chance.randrange(4):
        case 0:
            words[at] = chance.choice(WORDS)
        case 1:
            cut = chance.randint(0, len(word))
            words[at] = word[:cut] + chance.choice(WORDS) + word[cut + 1 :]
        case 2:
            words.insert(at, chance.choice(WORDS))
        case _:
            del words[at]
            words.append(word)


@contextmanager
def _on(bench: SlaveBench) -> Iterator[None]:
    """Let them find this bus whatever their SOURCE is."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (session, gateway_verb):
            patch.setattr(module, "open_conform_source", lambda *words: bench.source)
        yield

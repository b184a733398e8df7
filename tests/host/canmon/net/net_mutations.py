"""Mutated command lines, DCF and bus.yml files for `canmon net`: whatever they hold, a line."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.canmon.test_mutated import mutated
from tickrig.device import make_epos
from tickrig.device.canopen.models.f_palette_boot import make_f_palette_boot
from tickrig.emulators.testing.conformance.slave_bench import SlaveBench
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


class Mutations:
    """Mutated calls on one drive that lives on, and sometimes on a module with a boot loader.

    Args:
        seed: of all chance.
        folder: where files are written.
    """

    def __init__(self, seed: int, folder: Path) -> None:
        self._chance, self._folder = random.Random(seed), folder
        entries = make_epos(5).dictionary.description
        values = {entry.key: entry.power_on_data(5) for entry in entries}
        self._dcf = write_dcf(entries, 5, 1_000_000, values).encode()

    def run(self, count: int) -> None:
        """Call so often; AssertionError if a call ends otherwise than it may."""
        chance = self._chance
        for _ in range(count):
            make = chance.choice((make_epos, make_epos, make_f_palette_boot))
            with _on(SlaveBench(make(5), 1_000_000)):
                self._call()

    def _call(self) -> None:
        chance, path = self._chance, self._folder / "file"
        text = BUS if chance.random() < 0.2 else self._dcf
        path.write_bytes(mutated(chance, text) if chance.random() < 0.8 else b"\0" * 99)
        words = [word.format(file=path) for word in chance.choice(LINES).split()]
        for _ in range(chance.randint(0, 2)):
            self._mutate(words)
        result = CliRunner().invoke(main, ["net", "its-bus", *words], catch_exceptions=False)
        assert result.exit_code in STATUSES, words
        lines = [line for line in result.stderr.splitlines() if line.startswith("Error:")]
        assert len(lines) == bool(result.exit_code) or result.exit_code < 2, words

    def _mutate(self, words: list[str]) -> None:
        """Change a word: another one, a part of it, one more or one less."""
        chance = self._chance
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
    """Let `canmon net` find this bus whatever its SOURCE is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "open_conform_source", lambda *words: bench.source)
        yield

from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.emulators.testing.rig_file.plan import RigFileError
from tickrig.emulators.testing.rig_file.reader import parse_rig_file

NODE = "[[node]] is a device now, one for each node-ID:"


@pytest.mark.parametrize(
    ("text", "mistakes"),
    [
        (
            '[[node]]\nid = 5\nmodel = "epos"',
            [f'1: node[1]: {NODE} [device.node1] with type = "epos", node_id = 5'],
        ),
        (
            '[[node]]\nid = "5-6"\neds = "a.eds"\nprofile = "401"\n[[node]]\nrtc = "a.py:A"',
            [
                f'1: node[1]: {NODE} [device.node1] with type = "a.eds", node_id = "5-6", profile',
                f'5: node[2]: {NODE} [device.node2] with type = "a.py:A"',
            ],
        ),
        ("node = []", ["1: no device: a rig file has tables", "1: no key 'node'; known: seed"]),
        ("node = [5]", [f'1: node[1]: {NODE} [device.node1] with type = "FILE.eds"']),
        (
            '[dut.rrc]\nport = "/dev/ttyACM0"\n[tolerance]\nstick_pct = 5\n',
            ['1: dut: a real RRC is a device now: [device.rrc] with type = "rrc", [hardware.rrc]'],
        ),
        (
            '[device.a]\ntype = "rrc"\n[[node]]\nmodel = "epos"',
            [f'3: node[1]: {NODE} [device.node1] with type = "epos"'],
        ),
        ('[[component]]\nname = "a"', ["1: component: it is a system of RT components"]),
        ("# drive\n\n0.1s press power_button\n", ["1: it is a scenario: --scenario FILE plays"]),
        ("+10ms send hello", ["1: it is a scenario"]),
    ],
)
def test_a_file_of_before_is_told_what_to_write(text: str, mistakes: list[str]) -> None:
    with pytest.raises(RigFileError) as caught:
        parse_rig_file(text, Path("rig.toml"))
    found = [f"{line}: {reason}" for line, reason in caught.value.mistakes]
    assert len(found) == len(mistakes), found
    assert all(map(str.startswith, found, mistakes)), found

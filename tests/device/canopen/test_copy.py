from __future__ import annotations

from tests.device.canopen.reference import make_dictionary


def test_a_copy_has_the_defaults_and_nobodys_rules() -> None:
    original = make_dictionary()
    entry = original[0x2000, 0]
    entry.written = print
    entry.watch(print)
    entry.value = 7
    twin = original.copy()[0x2000, 0]
    assert (twin.value, twin.written, twin.watchers) == (0, None, ())
    twin.value = 9
    assert entry.value == 7


def test_a_copy_describes_the_same_objects() -> None:
    original = make_dictionary()
    twin = original.copy()
    assert twin.description is original.description
    assert [entry.description for entry in twin] == [entry.description for entry in original]
    assert twin.look_up(b"\x00\x20\x00") is twin[0x2000, 0]
    assert twin.objects == original.objects

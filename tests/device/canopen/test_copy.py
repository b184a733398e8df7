from __future__ import annotations

from tests.device.canopen.reference import make_dictionary
from tickrig.device.canopen.core.entry import Entry


def test_a_copy_has_the_defaults_and_nobodys_rules() -> None:
    original = make_dictionary()
    entry = original[0x2000, 0]
    entry.written = lambda: None
    entry.watchers.append(lambda: None)
    entry.value = 7
    twin = original.copy()[0x2000, 0]
    assert (twin.value, twin.written, twin.watchers) == (0, None, [])
    twin.value = 9
    assert entry.value == 7


def test_a_copy_describes_the_same_objects() -> None:
    original = make_dictionary()
    twin = original.copy()
    ours = ("data", "guard", "written", "source", "watchers")
    described = [name for name in Entry.__slots__ if name not in ours]
    for first, second in zip(original, twin, strict=True):
        assert all(getattr(first, name) == getattr(second, name) for name in described)
    assert list(original.by_multiplexer) == list(twin.by_multiplexer)
    assert twin.look_up(b"\x00\x20\x00") is twin[0x2000, 0]
    assert twin.objects == original.objects

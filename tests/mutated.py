"""Files as accidents leave them."""

from __future__ import annotations

from random import Random


def mutated(data: bytes, chance: Random) -> bytes:
    """Return a file that was cut, spoilt, or edited by somebody in a hurry."""
    out = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(out)) if out else 0
        match chance.randrange(7):
            case 0:
                del out[at:]
            case 1:
                out[at : at + 1] = bytes([chance.randrange(256)])
            case 2:
                del out[at : at + chance.randint(1, 30)]
            case 3:
                out[at:at] = bytes(chance.choices(b'0123456789.#"{}[]:,=<>!~ \\nx-e', k=3))
            case 4:
                lines = bytes(out).split(b"\n")
                chance.shuffle(lines)
                out = bytearray(b"\n".join(lines))
            case 5:
                out[at:at] = bytes(out[: chance.randint(1, 60)])
            case 6:
                numbers = [b"-1", b"1e999", b"NaN", b"null", b"true", b'""', b"[]", b"9" * 40]
                out[at : at + 1] = chance.choice(numbers)
    return bytes(out)

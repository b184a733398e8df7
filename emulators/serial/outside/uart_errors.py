"""Characters that a UART received with an error."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.serial.uart import Character


@dataclass(slots=True)
class UartErrors:
    """How many characters were wrong, each counted once, as Linux does (`TIOCGICOUNT`).

    Attributes:
        framing: the line was 0 where a stop bit should have been.
        parity: the parity bit was wrong.
        breaks: the line was 0 for a whole character.
    """

    framing: int = 0
    parity: int = 0
    breaks: int = 0

    def count(self, character: Character) -> None:
        """Count a character if it is wrong.

        Args:
            character: as it was received.
        """
        if character.line_break:
            self.breaks += 1
        elif character.parity_error:
            self.parity += 1
        elif character.framing_error:
            self.framing += 1

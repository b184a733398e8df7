"""What a codec says about bytes it cannot read.

WireError (ValueError)
 +-- FramingError     no message here: bad name, length or terminator
 +-- ChecksumError    a whole message, but its check does not match
 +-- FieldError       a sound message with a field out of range
"""

from __future__ import annotations

from tickrig._compiled import mypyc_attr


@mypyc_attr(allow_interpreted_subclasses=True)
class WireError(ValueError):
    """Bytes that are not a message of this protocol."""


@mypyc_attr(allow_interpreted_subclasses=True)
class FramingError(WireError):
    """No message here: bad name, length or terminator."""


@mypyc_attr(allow_interpreted_subclasses=True)
class ChecksumError(WireError):
    """A whole message, but its check does not match."""


@mypyc_attr(allow_interpreted_subclasses=True)
class FieldError(WireError):
    """A sound message with a field out of range."""

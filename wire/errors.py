"""Errors of codecs for bytes that they cannot read.

WireError (ValueError)
 +-- FramingError not a message: bad name, length or terminator
 +-- ChecksumError    a whole message, but its check does not match
 +-- FieldError       a sound message with a field out of range
"""

from __future__ import annotations

from tickrig._compiled import mypyc_attr


@mypyc_attr(allow_interpreted_subclasses=True)
class WireError(ValueError):
    """The bytes are not a message of the protocol."""


@mypyc_attr(allow_interpreted_subclasses=True)
class FramingError(WireError):
    """The bytes are not a message, because of a bad name, length or terminator."""


@mypyc_attr(allow_interpreted_subclasses=True)
class ChecksumError(WireError):
    """A complete message has a wrong checksum."""


@mypyc_attr(allow_interpreted_subclasses=True)
class FieldError(WireError):
    """A valid message has a field out of range."""

"""What tests devices of anybody: for the extra `test`, which brings pytest and Hypothesis."""

from tickrig._lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, {})

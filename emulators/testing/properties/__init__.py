"""What tests a device of anybody, over any session; what is done to it is drawn by Hypothesis."""

from tickrig.emulators.testing.properties import strategies as strategies

"""Tests of any device in any session; Hypothesis draws the traffic and the inputs."""

from tickrig.emulators.testing.properties import strategies as strategies

"""Components around the chain: game pads, range finders, and robots that go together."""

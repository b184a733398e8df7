"""Components around the chain: hands, eyes, and robots that go together."""

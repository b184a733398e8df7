"""Reports of a conformance run: text, JSON, JUnit, HTML, a badge."""

"""What people and programs are told of a conformance run: text, JSON, JUnit, HTML, a badge."""

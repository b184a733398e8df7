"""The conformance tester as a library: any slave in virtual time, one pytest test per check."""

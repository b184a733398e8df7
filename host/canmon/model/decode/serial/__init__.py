"""Lines of serial ports, decoded into the trace of the buses."""

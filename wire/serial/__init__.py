"""What is on a serial line below every protocol: characters of a UART, lines of text."""

"""Host-side proxies and monitors: hardware or emulator, they cannot tell."""

import logging

logging.getLogger("tickrig").addHandler(logging.NullHandler())  # a library is silent

"""RTC-Lite: a component on a device too small for middleware, behind its proxy."""

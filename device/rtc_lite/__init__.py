"""RTC-Lite: components on devices too small for middleware, controlled by a proxy."""

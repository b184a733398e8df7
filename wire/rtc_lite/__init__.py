"""RTC-Lite: the frames between a proxy component and the small device behind it."""

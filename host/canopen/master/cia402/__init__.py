"""A drive of CiA 402 as ros2_canopen's 402 driver drives it."""

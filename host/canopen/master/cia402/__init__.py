"""Drives of CiA 402, operated as by ros2_canopen's 402 driver."""

"""A CANopen master for tests: boots slaves as Lely's master does, drives CiA 402 drives."""

"""The demonstration of Fig. 120: a potentiometer turns a motor, without a PC in between."""

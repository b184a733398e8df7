"""A gateway to CANopen in lines of text: CiA 309-3, ASCII mapping."""

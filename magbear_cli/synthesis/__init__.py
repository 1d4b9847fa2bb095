"""Each module turns a control problem into a controller."""

"""The algebra of linear time-invariant systems."""

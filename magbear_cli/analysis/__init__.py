"""Each module judges a closed loop."""

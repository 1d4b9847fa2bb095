"""The only door to SLICOT, python-control and the conic solver; every answer's residual is looked at."""

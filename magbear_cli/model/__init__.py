"""The physics: force law, linearisation, rotor, sensor, weights, uncertainty, generalised plant."""

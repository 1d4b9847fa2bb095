"""magbear: proven limits of linear control for precision magnetic bearings, and the simplest controller at them."""

__version__ = "0.1.0"

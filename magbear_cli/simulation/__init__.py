"""Each module steps time."""

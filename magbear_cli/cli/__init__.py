"""One command a file; imports inside bodies."""

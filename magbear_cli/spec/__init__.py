"""A study file, believed or refused."""

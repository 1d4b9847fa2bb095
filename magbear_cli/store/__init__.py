"""HDF5: one shard a finished case, one deterministic results file."""

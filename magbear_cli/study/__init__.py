"""Which cases exist, and how one is computed."""

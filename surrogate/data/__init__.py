"""Data sets on disk: what was requested, its shards, and the whole."""

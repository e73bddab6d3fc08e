"""Data sets on disk: their request, their shards, and the whole field set."""

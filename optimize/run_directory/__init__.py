"""The directory of a run: its key, checkpoint, history and results."""

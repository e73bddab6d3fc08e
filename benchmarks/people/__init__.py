"""People: simulated observers, how often intervals hold the truth, and a whole experiment."""

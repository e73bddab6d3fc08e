"""Training data and nets: shard jobs, workers, fields, losses, set-ups and the training command."""

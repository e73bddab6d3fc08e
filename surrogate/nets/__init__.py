"""Networks, their training, their weights and the checkpoint of a training."""

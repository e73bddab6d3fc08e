"""What both nets share: the texture corpus, the network, its training and its weights."""

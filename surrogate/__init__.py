"""Learning that touch and sight share: the texture corpus, data sets, the network and its training."""

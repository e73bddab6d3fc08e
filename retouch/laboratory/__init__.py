"""The laboratory: studies of many runs, sets of stimuli, experiments with people, and training of the nets."""

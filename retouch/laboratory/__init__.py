"""The laboratory: studies of many runs, sets of stimuli, experiments with people, training of nets."""

"""The experiment served to this machine: answers are on disk as they are given."""

"""Experiments with people: plans of trials, pages that take answers, and results of answers."""

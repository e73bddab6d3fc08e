"""Experiments with people: plans of trials, pages that take answers, and what answers tell."""

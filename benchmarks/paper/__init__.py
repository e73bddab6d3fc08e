"""Figures and claims of the paper that are no table of runs: ours beside the paper's.

python -m benchmarks.paper [NAME ...]     # all, or: profiles filters eye touch cold

Numbers go to benchmarks/results/paper.json, pictures to docs/images. What is a table of runs is a study
file (docs/evidence/paper.md).
"""

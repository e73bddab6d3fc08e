"""The descent: the problem, its targets, the methods, and verification."""

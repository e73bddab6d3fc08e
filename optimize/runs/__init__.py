"""One run from beginning to end: preparation, descent, verification, and comparison of results."""

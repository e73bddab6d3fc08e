"""What the guide (`docs/parts.md`) has beside the parts of the benchmark: one more part, and the picture."""

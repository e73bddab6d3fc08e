"""What the guide (`docs/parts.md`) has beside the parts of the benchmark: a part of its own, and the picture."""

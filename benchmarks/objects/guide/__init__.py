"""The part and the picture that the guide (`docs/parts.md`) has beside those of the benchmark."""

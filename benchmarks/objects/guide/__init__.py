"""The part and the picture that the guide from idea to part (`docs/parts.md`) has beside those of the benchmark."""

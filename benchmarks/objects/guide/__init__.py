"""The part and the picture that the guide (`docs/tutorials/part.md`) has beside those of the benchmark."""

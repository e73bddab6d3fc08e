"""Published findings of touch, as rows that a model of a finger can be asked for (`findings.toml`)."""

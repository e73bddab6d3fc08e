"""The functions behind the verbs of the command, as `retouch` gives them to Python."""

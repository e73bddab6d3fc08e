"""The error that a user can cause and mend."""


class InputError(ValueError):
    """Bad input: one line that names the file and the field. The command line prints it and exits with 2."""

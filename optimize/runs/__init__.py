"""One run and its directory: settings, preparation, checkpoint, results."""

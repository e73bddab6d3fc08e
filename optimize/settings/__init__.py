"""Run files: the settings of a run, checked before any work begins."""

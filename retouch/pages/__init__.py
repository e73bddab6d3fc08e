"""The report of a run: page, figures, pictures and their metrics."""

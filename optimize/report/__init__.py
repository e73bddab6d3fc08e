"""What a person sees of a run: report page, figures, pictures and their metrics."""

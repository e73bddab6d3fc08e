"""Measures of the rows of a study beside those of result.json."""

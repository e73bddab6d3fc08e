"""A finger of one's own: a skin fitted to answers and to simple measurements."""

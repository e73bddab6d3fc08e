"""Pages about objects that the mouse turns: what will be wrapped, and how print files feel."""

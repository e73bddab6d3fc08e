"""Parts from public repositories, as their owners have them, and how they come out wrapped."""

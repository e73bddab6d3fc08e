"""What a relief leaves as: bodies with labels, their files, and what printers make of it."""

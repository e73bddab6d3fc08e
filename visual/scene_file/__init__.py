"""Scene files: checked as text, parsed, described; nothing is loaded unchecked."""

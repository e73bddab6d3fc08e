"""A scene file becomes a description: checked as text, parsed, described; nothing is loaded unchecked."""

"""Feel of solids: at places of a mesh, of its texture apart from its shape."""

"""Files of meshes: readers of formats, and the mesh that they give, with checks of what it holds."""

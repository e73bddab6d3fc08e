"""Feel of meshes: fingers on the surface of a print file, as numbers, a coloured file and a picture."""

"""Export: plates and labels, files of bodies, and bodies as printed."""

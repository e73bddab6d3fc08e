"""Pictures with exact gradients: shading, moving shadows and moving outlines."""

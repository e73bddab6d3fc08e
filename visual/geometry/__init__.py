"""The plate as triangles, the cameras that look at it, and where samples of a picture meet it."""

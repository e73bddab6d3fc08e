"""Published findings of touch, and which fingers and read-outs predict them."""

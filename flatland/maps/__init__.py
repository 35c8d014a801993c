"""Map files and map images, converted to the edges of a layer."""

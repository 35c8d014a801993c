"""Reading of map files and map images, and their conversion to the edges of a layer."""

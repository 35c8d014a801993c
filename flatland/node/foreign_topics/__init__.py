"""Topics of other nodes, for the viewer in the browser."""

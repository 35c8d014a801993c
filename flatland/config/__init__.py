"""World, model and map files: YAML with includes, `$eval` and typed values."""

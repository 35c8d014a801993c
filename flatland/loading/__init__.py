"""Creation of worlds and models from their YAML files."""

"""What plugins build on: base classes, ports, the registry, and helpers that plugins share."""

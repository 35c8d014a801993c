"""The plugin interface: base classes, ports, the registry, and helpers that plugins share."""

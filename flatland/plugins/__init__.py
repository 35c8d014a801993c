"""The included plugins, one module each, declared in `flatland_plugins.xml`."""

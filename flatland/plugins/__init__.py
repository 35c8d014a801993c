"""The included plugins, one module each; found through `flatland_plugins.xml`."""

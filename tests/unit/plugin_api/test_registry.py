"""Manifests, the look-up of plugin classes, and their errors."""

from __future__ import annotations

import sys

import pytest

from flatland import ModelPlugin, PluginError, WorldPlugin
from flatland.plugin_api.manifest import read_manifest, read_reference_names
from flatland.plugin_api.registry import PluginRegistry

MANIFEST = """
<library path="src">
  <class name="{package}::Good" type="{package}.things.Good"
         base_class_type="flatland::ModelPlugin">
    <description> Does   good </description>
  </class>
  <class type="{package}.things.World" base_class_type="flatland::WorldPlugin"/>
  <class name="{package}::NoModule" type="{package}.nowhere.X"
         base_class_type="flatland::ModelPlugin"/>
  <class name="{package}::NoClass" type="{package}.things.Absent"
         base_class_type="flatland::ModelPlugin"/>
  <class name="{package}::NoPlugin" type="{package}.things.Plain"
         base_class_type="flatland::ModelPlugin"/>
  <class name="{package}::Wrong" type="{package}.things.World"
         base_class_type="flatland::ModelPlugin"/>
  <class name="{package}::Broken" type="{package}.broken.X"
         base_class_type="flatland::ModelPlugin"/>
  <class name="{package}::Quits" type="{package}.quits.X"
         base_class_type="flatland::ModelPlugin"/>
  <class name="{package}::Faulty" type="{package}.things.Faulty"
         base_class_type="flatland::ModelPlugin"/>
</library>
"""

THINGS = """
import flatland

class Good(flatland.ModelPlugin):
    pass

class World(flatland.WorldPlugin):
    pass

class Plain:
    pass

class Faulty(flatland.ModelPlugin):
    def __init__(self):
        raise RuntimeError("no device")
"""


@pytest.fixture
def package(files, request, monkeypatch):
    """A plugin package on disk with a unique name; yields its name and manifest."""
    name = f"robots_{abs(hash(request.node.nodeid))}"
    files.write(f"src/{name}/__init__.py", "")
    files.write(f"src/{name}/things.py", THINGS)
    files.write(f"src/{name}/broken.py", "import no_such_module_anywhere")
    files.write(f"src/{name}/quits.py", "import sys\nsys.exit('no licence')\n")
    manifest = files.write("plugins.xml", MANIFEST.format(package=name))
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", manifest)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield name, manifest
    for module in [module for module in sys.modules if module.startswith(name)]:
        del sys.modules[module]


def test_included_plugins_need_no_prefix():
    registry = PluginRegistry()
    assert registry.find("Laser").class_path == "flatland.plugins.laser.Laser"
    assert registry.find("flatland_plugins::Laser") is registry.find("Laser")


def test_every_included_class_can_be_instantiated():
    registry = PluginRegistry()
    entries = [e for n, e in registry.classes.items() if n.startswith("flatland_plugins::")]
    assert len(entries) >= 6
    for entry in entries:
        base = ModelPlugin if entry.base_class_type == "flatland::ModelPlugin" else WorldPlugin
        assert isinstance(registry.create(entry.lookup_name, base), base)
        assert entry.description


def test_a_class_is_imported_when_it_is_instantiated(package):
    name, manifest = package
    registry = PluginRegistry()
    entry = registry.find(f"{name}::Good")
    assert (entry.manifest, entry.description) == (manifest, "Does good")
    assert f"{name}.things" not in sys.modules
    plugin = registry.create(f"{name}::Good", ModelPlugin)
    assert type(plugin).__module__ == f"{name}.things"


def test_the_name_defaults_to_the_type(package):
    name, _ = package
    assert isinstance(PluginRegistry().create(f"{name}.things.World", WorldPlugin), WorldPlugin)


@pytest.mark.parametrize(
    ("which", "text"),
    [
        ("NoModule", r'module "{0}.nowhere" of plugin "{0}::NoModule" .* cannot be imported: '
         r"ModuleNotFoundError: No module named '{0}.nowhere'"),
        ("Broken", r"cannot be imported: ModuleNotFoundError: No module named 'no_such_module"),
        ("Quits", "cannot be imported: SystemExit: no licence"),
        ("NoClass", r'module "{0}.things" .* has no class "Absent"'),
        ("NoPlugin", r'"{0}.things.Plain" of plugin "{0}::NoPlugin" must be a class derived from '
         "flatland::ModelPlugin"),
        ("Wrong", r'class "{0}.things.World" of plugin "{0}::Wrong" must be a '
         r"flatland::ModelPlugin, got a flatland::WorldPlugin \(manifest .* declares a "
         r"flatland::ModelPlugin\)"),
        ("Faulty", r'class "{0}.things.Faulty" cannot be instantiated: RuntimeError: no device'),
    ],
)  # fmt: skip
def test_errors_name_the_class_and_the_cause(package, which, text):
    name, _ = package
    with pytest.raises(PluginError, match=text.format(name)):
        PluginRegistry().create(f"{name}::{which}", ModelPlugin)


@pytest.mark.parametrize(
    ("encoding", "why"),
    [("utf-9", "unknown encoding: utf-9"), ("gb2312", "multi-byte encodings are not supported")],
)
def test_an_invalid_manifest_is_reported_and_does_not_hide_the_others(
    files, monkeypatch, encoding, why
):
    path = files.write("m.xml", f'<?xml version="1.0" encoding="{encoding}"?><library/>')
    text = f'manifest "{path}" cannot be read: {why}'
    with pytest.raises(PluginError) as caught:
        read_manifest(path)
    assert text in str(caught.value)
    # The other manifests are read, and an unsuccessful look-up reports the invalid ones.
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", f"{path}:/nowhere/else.xml")
    registry = PluginRegistry()
    assert registry.find("Laser")
    with pytest.raises(PluginError) as caught:
        registry.find("my::Plugin")
    missing = 'manifest "/nowhere/else.xml" cannot be read: No such file or directory'
    assert f"; manifests with errors: {text}" in str(caught.value)
    assert missing in str(caught.value)


def test_several_libraries_in_one_manifest_of_which_cpp_classes_are_skipped(files):
    path = files.write(
        "m.xml",
        """
        <class_libraries>
          <library>
            <class type="x::Cpp" base_class_type="flatland_server::ModelPlugin"/>
            <class type="a.B" base_class_type="flatland::ModelPlugin"/>
          </library>
          <library path="x"><class type="c.D" base_class_type="flatland::WorldPlugin"/></library>
        </class_libraries>
        """,
    )
    first, second = read_manifest(path)
    assert (first.lookup_name, first.class_path, first.import_path) == ("a.B", "a.B", None)
    assert (second.class_path, second.import_path) == ("c.D", str(files.folder / "x"))
    assert read_reference_names(path) == ["x::Cpp"]


PACKAGE = """
<package format="2">
  <name>{name}</name><version>0.0.1</version><description>x</description>
  <maintainer email="a@example.org">a</maintainer><license>BSD</license>
  <export><flatland plugin="${{prefix}}/plugins.xml"/></export>
</package>
"""


def test_an_invalid_package_does_not_hide_the_others(package, files, monkeypatch):
    name, manifest = package
    files.write("package.xml", PACKAGE.format(name=name))
    other = files.write("other/package.xml", PACKAGE.format(name="other").replace("<exp", "<<"))
    monkeypatch.delenv("FLATLAND_PLUGIN_PATH")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{files.folder / 'other'}:{files.folder}")
    registry = PluginRegistry()
    assert registry.find(f"{name}::Good").manifest == manifest
    with pytest.raises(PluginError, match=rf'with errors: "{other}" is not XML, not well-formed'):
        registry.find("other::Good")


def test_a_package_that_is_added_later_is_found(package, files, monkeypatch):
    name, manifest = package
    monkeypatch.delenv("FLATLAND_PLUGIN_PATH")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(files.folder))
    registry = PluginRegistry()
    assert registry.find_missing([f"{name}::Good", "Laser"]) == [f"{name}::Good"]
    files.write("package.xml", PACKAGE.format(name=name))
    assert registry.find(f"{name}::Good").manifest == manifest
    # A class is renamed in the manifest; the folders are unchanged.
    assert registry.find_missing([f"{name}::New"]) == [f"{name}::New"]
    text = MANIFEST.format(package=name).replace("::Good", "::New")
    files.write("plugins.xml", text)
    assert registry.find(f"{name}::New").class_path == f"{name}.things.Good"
    assert registry.find_missing([f"{name}::Good"]) == [f"{name}::Good"]


def test_manifests_are_read_again_only_after_a_change(package, files, monkeypatch, caplog):
    name, manifest = package
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", f"{manifest}:{files.folder}/absent.xml")
    registry = PluginRegistry()
    for _ in range(3):
        assert registry.find_missing(["a::B", "a::C"]) == ["a::B", "a::C"]
    assert caplog.text.count("absent.xml") == 1
    files.write("absent.xml", MANIFEST.format(package=name).replace("::Good", "::Late"))
    assert registry.find_missing([f"{name}::Late"]) == []


def test_python_distributions_are_found(package, files, monkeypatch):
    name, _ = package
    files.write(f"src/{name}/flatland_plugins.xml", MANIFEST.format(package=name))
    files.write(
        f"src/{name}-1.0.dist-info/entry_points.txt", f"[flatland.plugins]\nrobots = {name}\n"
    )
    files.write(f"src/{name}-1.0.dist-info/METADATA", f"Name: {name}\nVersion: 1.0\n")
    monkeypatch.delenv("FLATLAND_PLUGIN_PATH")
    monkeypatch.syspath_prepend(str(files.folder / "src"))
    found = PluginRegistry().find(f"{name}::Good")
    assert found.manifest == str(files.folder / "src" / name / "flatland_plugins.xml")


def test_a_hidden_class_causes_a_warning(package, files, monkeypatch, caplog):
    name, manifest = package
    other = files.write("other.xml", MANIFEST.format(package=name))
    monkeypatch.setenv("FLATLAND_PLUGIN_PATH", f"{manifest}:{other}")
    assert PluginRegistry().find(f"{name}::Good").manifest == manifest
    assert f'plugin "{name}::Good" of "{other}" is hidden by the one of "{manifest}"' in caplog.text

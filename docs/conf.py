"""Configuration of the documentation site, which `make docs` builds with Sphinx.

The source folder is the root of the repository, so that the pages and their relative links are the
same on the site and on a code host. `toc.yml` lists the pages.
"""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from docutils import nodes
from sphinx import addnodes
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.typing import stringify_annotation

import flatland

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

_ROOT = Path(__file__).resolve().parent.parent
# Types of numpy as they are evaluated, and as they are written.
_NUMPY_TYPES = {
    stringify_annotation(npt.ArrayLike, "smart"): "ArrayLike",
    stringify_annotation(npt.NDArray[np.uint8], "smart"): "npt.NDArray[np.uint8]",
}

project = "flatland"
author = "The flatland developers"
copyright = author  # noqa: A001  (name given by Sphinx)
release = version = flatland.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_external_toc",
]
external_toc_path = "docs/toc.yml"
external_toc_exclude_missing = True
# Folders that are not searched for pages.
exclude_patterns = [".*", "build", "devel", "install", "**/__pycache__"]
nitpicky = True

# -- pages in Markdown

myst_heading_anchors = 4  # same anchors as on code hosts, checked by tools/check_links.py
myst_links_external_new_tab = False
copybutton_exclude = ".linenos, .gp, .go"

# -- reference from docstrings

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True}
# Described in api/types.rst.
autodoc_type_aliases = {
    name: name
    for name in (
        "BoolArray",
        "Bounds",
        "Color",
        "DoubleArray",
        "EndingFunction",
        "FaultPolicy",
        "FloatArray",
        "FramePair",
        "IfBlocked",
        "InvalidBodyPolicy",
        "Key",
        "Kind",
        "NodeKind",
        "Params",
        "Phase",
        "Pose",
        "RewardFunction",
        "SkippedHandler",
        "SpeedLimits",
        "Triple",
        "UpdateFunction",
        "Vector2",
    )
}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = False
napoleon_use_rtype = False
python_maximum_signature_line_length = 90
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"
add_module_names = False
default_role = "py:obj"  # code in single backquotes is linked if it is the name of an object
nitpick_ignore_regex = [
    # Other projects; their documentation is not fetched during the build.
    (r"py:class", r"(np|npt|numpy|pybind11_builtins)\..*"),
    (r"py:class", r"(builtins|collections\.abc|concurrent\.futures|contextlib|os|threading)\..*"),
    (r"py:class", "Future"),
    (r"py:(class|exc)", r"(gymnasium|pathlib|pettingzoo)\..*"),
    # Of Gymnasium.
    (r"py:exc", r"(ClosedEnvironmentError|DependencyNotInstalled|InvalidAction|ResetNeeded)"),
    # Names that are imported only for type checkers, or are not described.
    (
        r"py:class",
        r"(Drawn|Episodes|FleetEnv|Laser|Line|Outline|Path|PluginWorld|ReadYaml|Rows?|Touches|"
        r"Update)",
    ),
    (r"py:class", r"flatland\.(plugin_api\.ports\.CommandSource|timekeeper\.SimulatedTime)"),
    (r"py:exc", "MissingPackageError"),
    (r"py:class", r"flatland\.web\.foreign_topics\.ForeignTopics"),
    (r"py:class", r"flatland\._core\..*"),
    # Type variables.
    (r"py:(class|obj)", r"(flatland\.[a-z_.]+\.)?[CDHRT]"),
]
# Classes that programs create; the others are created by flatland.
_CONSTRUCTED = {
    "flatland.DynamicsLimits",
    "flatland.Timekeeper",
    "flatland.UpdateTimer",
    "flatland.gym.BeamDropout",
    "flatland.gym.CommandLatency",
    "flatland.gym.Costmap",
    "flatland.gym.DiscreteAction",
    "flatland.gym.DriveLimits",
    "flatland.gym.FixedGoal",
    "flatland.gym.FlatlandEnv",
    "flatland.gym.FlatlandVectorEnv",
    "flatland.gym.FleetVectorEnv",
    "flatland.gym.Friction",
    "flatland.gym.Goal",
    "flatland.gym.HolonomicAction",
    "flatland.gym.LastAction",
    "flatland.gym.LocalMap",
    "flatland.gym.Observation",
    "flatland.gym.ObservationLatency",
    "flatland.gym.ObstacleSize",
    "flatland.gym.Payload",
    "flatland.gym.Proximity",
    "flatland.gym.RandomGoal",
    "flatland.gym.RobotSize",
    "flatland.gym.Scan",
    "flatland.gym.ScanDropout",
    "flatland.gym.ScanNoise",
    "flatland.gym.Stacked",
    "flatland.gym.SteeringAction",
    "flatland.gym.Strayed",
    "flatland.gym.Velocity",
    "flatland.gym.VelocityAction",
    "flatland.recording.Replay",
    "flatland.simulation.Simulation",
}

# -- HTML

html_theme = "furo"
html_title = "flatland"
html_static_path = ["_static"]
html_css_files = ["site.css"]
templates_path = ["_templates"]
html_additional_pages = {"index": "redirect.html"}  # the first page is docs/README.html
html_copy_source = False
html_show_sphinx = False
pygments_style = "friendly"
pygments_dark_style = "github-dark"


def link_folders(app: Sphinx, doctree: nodes.document) -> None:
    """Converts links to folders, which have no page, to links to their README.md or to text."""
    del app
    folder = Path(doctree["source"]).parent
    for link in list(doctree.findall(addnodes.pending_xref)):
        if link.get("reftype") != "myst" or link.get("refdomain") == "doc":
            continue
        target = (folder / link["reftarget"]).resolve()
        if not target.is_dir() or not target.is_relative_to(_ROOT):
            continue
        if (target / "README.md").exists():
            link["refdomain"] = "doc"
            link["reftarget"] = str((target / "README").relative_to(_ROOT))
            link["reftargetid"] = None
        else:
            link.replace_self(link.children)


def show_signature(
    app: Sphinx,
    kind: str,
    name: str,
    documented: Any,
    options: Any,
    signature: str | None,
    result: str | None,
) -> tuple[str | None, str | None]:
    """Shortens numpy types, and omits the arguments of classes that programs do not create."""
    del app, options
    if kind == "class" and not dataclasses.is_dataclass(documented) and name not in _CONSTRUCTED:
        return ("", None)
    return (_shorten(signature), _shorten(result))


def _shorten(text: str | None) -> str | None:
    if text is None:
        return None
    for long, short in _NUMPY_TYPES.items():
        text = text.replace(long, short)
    # How Sphinx writes an alias in a union.
    return re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text)


def keep_colons(
    app: Sphinx, kind: str, name: str, documented: Any, options: Any, lines: list[str]
) -> None:
    """Keeps the first line of a property, where napoleon takes text before a colon for a type."""
    del app, name, documented, options
    if kind == "property":
        lines.insert(0, "\\ ")


def show_attribute_types(
    app: Sphinx, kind: str, name: str, documented: Any, options: Any, lines: list[str]
) -> None:
    """Puts the type of an attribute behind its name; napoleon writes a separate field."""
    del app, kind, name, documented, options
    heading = 0
    for number, line in enumerate(lines):
        if line.startswith(".. attribute::"):
            heading = number
        elif heading and line.startswith("   :type:"):
            lines.insert(heading + 1, lines.pop(number))
            heading = 0


def link_name(
    app: Sphinx, environment: BuildEnvironment, link: addnodes.pending_xref, text: nodes.Element
) -> nodes.Element | None:
    """Resolves the names of types in signatures, and displays code that is not a name."""
    if link.get("refdomain") == "py" and link.get("reftype") == "obj":
        return text
    if link.get("refdomain") != "py" or link.get("reftype") != "class":
        return None
    domain = environment.get_domain("py")
    return domain.resolve_xref(
        environment, link["refdoc"], app.builder, "type", link["reftarget"], link, text
    )


def omit_overloads(app: Sphinx) -> None:
    """Omits the overloads of `YamlReader`, one per kind of value, which are for type checkers."""
    del app
    analyzer = ModuleAnalyzer.for_module("flatland.config.reader")
    analyzer.analyze()
    analyzer.overloads.clear()


def setup(app: Sphinx) -> None:
    """Registers the event handlers of this file."""
    app.connect("builder-inited", omit_overloads)
    app.connect("doctree-read", link_folders)
    app.connect("missing-reference", link_name)
    app.connect("autodoc-process-signature", show_signature)
    app.connect("autodoc-process-docstring", keep_colons, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", show_attribute_types, priority=600)  # after napoleon

"""Generates flatland/_core.pyi, the stub of the extension, from the docstrings of the extension.

pybind11 writes the signature of each function into the first line of its docstring.

    python tools/make_stub.py            writes the stub
    python tools/make_stub.py --check    fails if the stub is outdated
"""

from __future__ import annotations

import argparse
import ast
import difflib
import inspect
import re
import subprocess
import sys
import types
from collections.abc import Iterator
from pathlib import Path

from flatland import _core, physics

STUB = Path(__file__).parents[1] / "flatland" / "_core.pyi"
# Names in signatures, and how the stub writes them.
NAMES = (
    (r"typing\.SupportsFloat \| typing\.SupportsIndex", "float"),
    (r"typing\.SupportsInt \| typing\.SupportsIndex", "int"),
    (r"numpy\.typing\.", "npt."),
    (r"\b(collections\.abc|typing|flatland\._core|flatland\.physics)\.", ""),
    (r"numpy\.ndarray", "npt.NDArray"),
    (r"NDArray\[(numpy\.)?bool\]", "NDArray[np.bool_]"),
    (r"numpy\.", "np."),
    (r"<[^<>]*>", "..."),  # a default value that is no literal
)
# Generic types: as results, as arguments, and their parameters if the signature has none.
GENERICS = {
    "Tuple": ("tuple", "tuple", "Any, ..."),
    "tuple": ("tuple", "tuple", "Any, ..."),
    "List": ("list", "Sequence", "Any"),
    "list": ("list", "list", "Any"),
    "Dict": ("dict", "Mapping", "Any, Any"),
    "dict": ("dict", "dict", "Any, Any"),
    "Set": ("set", "Set", "Any"),
    "Callable": ("Callable", "Callable", "..., Any"),
    "function": ("Callable", "Callable", "..., Any"),
}
ABC = ("Callable", "Iterable", "Mapping", "Sequence", "Set")
OWN = [name for name in physics.__all__ if name not in vars(_core)]
SKIPPED = frozenset(
    [
        *("__module__", "__doc__", "__qualname__", "__new__", "_pybind11_conduit_v1_"),
        *("__reduce_ex__", "copy_advice"),  # set by `flatland.uncopied`
    ]
)


class TypeWriter(ast.NodeTransformer):
    """Writes types in the same way for all versions of pybind11."""

    def __init__(self, *, is_argument: bool) -> None:
        """Creates a writer of types of arguments or of results."""
        self.is_argument = is_argument

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Writes a type with parameters."""
        name = ast.unparse(node.value)
        if name in GENERICS:
            node.value = ast.Name(GENERICS[name][self.is_argument])
        node.slice = self.visit(node.slice)
        if name == "Annotated" or (name == "npt.NDArray" and self.is_argument):
            return parsed_type("npt.ArrayLike")
        if name in ("Optional", "Union"):
            slices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            parts = [*map(ast.unparse, slices), *(["None"] if name == "Optional" else [])]
            return parsed_type(" | ".join(parts))
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Writes a type without parameters."""
        if node.id not in GENERICS:
            return node
        name = GENERICS[node.id][self.is_argument]
        return parsed_type(f"{name}[{GENERICS[node.id][2]}]")

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Writes an array of any type."""
        if ast.unparse(node) != "npt.NDArray":
            return node
        return parsed_type("npt.ArrayLike" if self.is_argument else "npt.NDArray[Any]")


def parsed_type(text: str) -> ast.expr:
    """Returns the syntax tree of a type."""
    return ast.parse(text, mode="eval").body


def split_docstring(docstring: str) -> tuple[str, str]:
    """Returns the signature and the description in a docstring of pybind11."""
    signature, _, description = docstring.partition("\n")
    for pattern, text in NAMES:
        signature = re.sub(pattern, text, signature)
    return signature.strip(), inspect.cleandoc(description)


def function_lines(name: str, docstring: str, *decorators: str) -> Iterator[str]:
    """Yields the lines of a function or of an accessor of a property."""
    signature, description = split_docstring(docstring)
    parsed = ast.parse(f"def {name}{signature[signature.index('(') :]}: ...").body[0]
    if not isinstance(parsed, ast.FunctionDef):
        raise TypeError(f"{signature} is not the signature of a function")
    arguments = parsed.args
    if decorators and decorators != ("staticmethod",):  # accessors have no names of arguments
        for argument, other in zip(arguments.args, ("self", "value"), strict=False):
            argument.arg = other
    for argument in (*arguments.args, *arguments.kwonlyargs):
        if argument.annotation is not None:
            argument.annotation = TypeWriter(is_argument=True).visit(argument.annotation)
        if argument.arg == "self":
            argument.annotation = None
    if parsed.returns is not None:
        parsed.returns = TypeWriter(is_argument=False).visit(parsed.returns)
    # A comparison with another object returns NotImplemented.
    if name == "__eq__":
        arguments.args[1].annotation = ast.Name("object")
    for defaults in (arguments.defaults, arguments.kw_defaults):
        defaults[:] = [d if d is None or is_literal(d) else ast.Constant(...) for d in defaults]
    yield from (f"@{decorator}" for decorator in decorators)
    definition = ast.unparse(parsed).splitlines()[0]
    yield definition if description else f"{definition} ..."
    if description:
        yield from indented(docstring_lines(description))


def is_literal(node: ast.expr) -> bool:
    """Returns whether an expression is a literal."""
    try:
        ast.literal_eval(node)
    except ValueError:
        return False
    return True


def docstring_lines(text: str) -> list[str]:
    """Returns the lines of a docstring."""
    lines = text.splitlines()
    return [f'"""{text}"""'] if len(lines) == 1 else [f'"""{lines[0]}', *lines[1:], '"""']


def indented(lines: list[str] | Iterator[str]) -> Iterator[str]:
    """Yields indented lines."""
    return (f"    {line}" if line else "" for line in lines)


def member_lines(name: str, member: object) -> Iterator[str]:
    """Yields the lines of a member of the module or of a class."""
    if isinstance(member, type):
        yield from class_lines(member)
    elif isinstance(member, property):
        signature = (member.fget.__doc__ or "").partition("\n")[0]
        yield from function_lines(name, f"{signature}\n{member.__doc__ or ''}", "property")
        if member.fset is not None:
            yield from function_lines(name, member.fset.__doc__ or "", f"{name}.setter")
    elif isinstance(member, staticmethod):
        yield from function_lines(name, member.__func__.__doc__ or "", "staticmethod")
    elif callable(member):
        yield from function_lines(name, member.__doc__ or "")
    elif isinstance(member, str):
        yield f"{name}: str"
    else:
        raise TypeError(f"{name} is of an unknown kind, {type(member).__name__}")


def class_lines(cls: type) -> Iterator[str]:
    """Yields the lines of a class."""
    bases = [base.__name__ for base in cls.__bases__ if base.__module__ == "flatland._core"]
    yield f"class {cls.__name__}({', '.join(bases)}):" if bases else f"class {cls.__name__}:"
    yield from indented(docstring_lines(inspect.cleandoc(cls.__doc__ or "")))
    for name, member in vars(cls).items():
        # Classes that cannot be created have a constructor that raises.
        if name not in SKIPPED and not isinstance(member, types.WrapperDescriptorType):
            yield from indented(member_lines(name, member))


def make_stub() -> str:
    """Returns the stub."""
    body: list[str] = []
    for name, member in vars(_core).items():
        if not name.startswith("__"):
            body += member_lines(name, member)
    text = "\n".join(body)
    code = "\n".join(line for line in body if re.match(r" *(def|class)\b", line))
    header = [f'"""{_core.__doc__}\n\nGenerated by tools/make_stub.py.\n"""']
    for module, names in (
        ("collections.abc", ABC),
        ("typing", ("Any",)),
        ("flatland.physics", OWN),
    ):
        used = [name for name in names if re.search(rf"\b{name}\b", code)]
        header.append(f"from {module} import {', '.join(used)}")
    header += ["import numpy as np", "import numpy.typing as npt"]
    return tidy("\n".join([*header, text]))


def tidy(text: str) -> str:
    """Returns a source with sorted imports in the format of the project."""
    ruff = [sys.executable, "-m", "ruff"]
    name = ["--stdin-filename", str(STUB)]
    for command in (["check", "--select=I", "--fix-only", "--quiet"], ["format"]):
        text = subprocess.run(  # noqa: S603
            [*ruff, *command, *name, "-"], input=text, capture_output=True, text=True, check=True
        ).stdout
    return text


def main() -> None:
    """Writes or checks the stub."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="fail if the stub is outdated")
    options = parser.parse_args()
    stub = make_stub()
    if not options.check:
        STUB.write_text(stub)
        return
    old = STUB.read_text()
    if old != stub:
        difference = difflib.unified_diff(old.splitlines(), stub.splitlines(), lineterm="", n=0)
        sys.exit("\n".join([*difference, f"{STUB} is outdated; make stub writes it"]))


if __name__ == "__main__":
    main()

"""Generates and compiles Python packages of messages in an environment of ROS 2 wheels.

    PYTHON_OF_THE_ENVIRONMENT tools/ros2_messages.py PACKAGE_FOLDER...

A folder has the name of its package and contains `msg/*.msg`, `srv/*.srv` and `action/*.action`.
The generators are those of the wheels of rosidl. They are called without CMake, and only those
whose results rclpy uses with rmw_fastrtps: the structures in C, their type supports, and their
conversion from and to Python. All of it becomes one extension module for each package.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import rosidl_generator_type_description
import rosidl_pycommon
from rosidl_adapter import convert_to_idl
from rosidl_generator_c import generate_c
from rosidl_generator_py import generate_py_impl
from rosidl_parser.definition import IdlFile, IdlLocator
from rosidl_parser.parser import parse_idl_file
from rosidl_typesupport_c import generate_c as generate_type_support
from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c
from rosidl_typesupport_introspection_c import generate_c as generate_introspection

PREFIX = Path(sys.prefix)
SITE = Path(sysconfig.get_path("purelib"))
KINDS = ("msg", "srv", "action")
# Little optimization: the set-up waits for the compiler, and large messages are in the wheels.
FLAGS = ("-O1", "-fPIC", "-w")
# Both are used by rmw_fastrtps, the second one for the description of a type that others receive.
TYPE_SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
GENERATORS: dict[str, Callable[[str], object]] = {
    "rosidl_generator_c": generate_c,
    "rosidl_typesupport_fastrtps_c": generate_typesupport_fastrtps_c,
    "rosidl_typesupport_introspection_c": generate_introspection,
    "rosidl_typesupport_c": lambda file: generate_type_support(file, TYPE_SUPPORTS),
    "rosidl_generator_py": lambda file: generate_py_impl.generate_py(
        file, ["rosidl_typesupport_c"]
    ),
}


@functools.cache
def parse_once(folder: Path, file: Path) -> IdlFile:
    """Parses a definition. The generators would do so one after the other."""
    return parse_idl_file(IdlLocator(folder, file))


for module in (rosidl_pycommon, rosidl_generator_type_description, generate_py_impl):
    module.parse_idl_file = lambda locator: parse_once(locator.basepath, locator.relative_path)


def main() -> None:
    """Processes the packages in parallel: each generator is a Python program of one thread."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("packages", nargs="+", type=Path, help="folder of a package")
    packages: list[Path] = parser.parse_args().packages
    if sys.prefix == sys.base_prefix:
        parser.error(f"{sys.executable} is not the interpreter of a virtual environment")
    if len(packages) == 1:
        install(packages[0].resolve())
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        commands = [[sys.executable, __file__, each] for each in packages]
        runs = list(pool.map(subprocess.run, commands))
    sys.exit(max(run.returncode for run in runs))


def install(package: Path) -> None:
    """Generates, compiles and installs a package.

    Args:
        package: folder with the name of the package
    """
    name = package.name
    with tempfile.TemporaryDirectory(prefix="ros2_messages_") as folder:
        work = Path(folder)
        share = work / "share" / name
        for file in sorted(each for kind in KINDS for each in package.glob(f"{kind}/*.{kind}")):
            convert_to_idl(package, name, file.relative_to(package), share)
            shutil.copyfile(file, share / file.relative_to(package))
        generate(share)
        extension = compile_extension(work, name)

        site = replace_folder(work / "rosidl_generator_py" / name, SITE / name, "*.c")
        (site / "__init__.py").touch()
        shutil.copy(extension, site)
        # Type supports are loaded by the names of their libraries.
        for type_support in TYPE_SUPPORTS:
            library = PREFIX / "lib" / f"lib{name}__{type_support}.so"
            library.unlink(missing_ok=True)
            library.symlink_to(site / extension.name)
        installed = replace_folder(share, PREFIX / "share" / name)
    # The index in which programs of ROS search for packages and their definitions.
    index = PREFIX / "share" / "ament_index" / "resource_index"
    definitions = sorted(installed.rglob("*.*"))
    names = "\n".join(str(file.relative_to(installed)) for file in definitions)
    (index / "packages" / name).write_text("")
    (index / "rosidl_interfaces" / name).write_text(names)


def generate(share: Path) -> None:
    """Runs the generators, each with its name as output folder beside the folder `share`.

    Args:
        share: folder `share/PACKAGE` with the definitions as .idl; type descriptions are added
    """
    name = share.name
    others = PREFIX / "share"
    definitions = [file.relative_to(share) for file in sorted(share.rglob("*.idl"))]
    arguments: dict[str, object] = {
        "package_name": name,
        "idl_tuples": [f"{share}:{file}" for file in definitions],
        "ros_interface_dependencies": [
            f"{file.parents[1].name}:{file}" for file in others.glob("*/*/*.idl")
        ],
        "ros_interface_files": [str(share / file) for file in definitions],
        "type_description_tuples": [
            f"{file}:{(share / file).with_suffix('.json')}" for file in definitions
        ],
        "include_paths": [f"{folder.name}:{folder}" for folder in others.iterdir()],
        "target_dependencies": [],
    }

    def arguments_of(generator: str, output: Path) -> str:
        templates = str(others / generator / "resource")
        file = share.parent / f"{generator}.json"
        file.write_text(
            json.dumps({**arguments, "template_dir": templates, "output_dir": str(output)})
        )
        return str(file)

    rosidl_generator_type_description.generate_type_hash(
        arguments_of("rosidl_generator_type_description", share)
    )
    for generator, function in GENERATORS.items():
        output = share.parents[1] / generator / name
        function(arguments_of(generator, output))
        template = others / generator / "resource" / f"{generator}__visibility_control.h.in"
        if template.exists():
            header = template.read_text().replace("@PROJECT_NAME_UPPER@", name.upper())
            (output / "msg").mkdir(exist_ok=True)
            (output / "msg" / template.stem).write_text(header.replace("@PROJECT_NAME@", name))


def compile_extension(work: Path, package: str) -> Path:
    """Compiles the generated code.

    Args:
        work: folder with a folder for each generator
        package: name of the package

    Returns:
        The extension module.
    """
    include = [*(work / each for each in GENERATORS), sysconfig.get_path("include")]
    include += [np.get_include(), PREFIX / "include", *(PREFIX / "include").iterdir()]
    options = work / "options"
    options.write_text("\n".join([*FLAGS, *(f"-I{folder}" for folder in include)]))

    def run(*command: object) -> None:
        subprocess.run([str(each) for each in command], check=True, cwd=work)  # noqa: S603

    # Few translation units, because headers cost most of the time. Type descriptions define static
    # variables of equal names.
    descriptions = sorted(work.rglob("*__description.c"))
    structures = sorted(set(work.rglob("*.c")) - set(descriptions))
    units = {"structures.c": structures, "type_supports.cpp": sorted(work.rglob("*.cpp"))}
    for unit, files in units.items():
        (work / unit).write_text("".join(f'#include "{file}"\n' for file in files))
    run("gcc", f"@{options}", "-c", *units, *descriptions)

    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    extension = work / f"{package}_s__rosidl_typesupport_c{suffix}"
    libraries = (PREFIX / "lib").glob("lib*.so")
    run("g++", "-shared", *work.glob("*.o"), "-Wl,--as-needed", *libraries, "-o", extension)
    return extension


def replace_folder(source: Path, target: Path, *ignored: str) -> Path:
    """Copies a folder to the place of another one.

    Args:
        source: existing folder
        target: folder that is replaced
        ignored: patterns of names that are not copied

    Returns:
        target
    """
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(source, target, ignore=shutil.ignore_patterns(*ignored))
    return target


if __name__ == "__main__":
    main()

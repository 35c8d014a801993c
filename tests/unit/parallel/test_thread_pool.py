"""The thread pool of the core, by a test program in C++."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_name("thread_pool_test.cpp")
CORE = Path(__file__).parents[3] / "src/cpp"
TESTS = re.findall(r'\{"(\w+)", test_\w+\}', SOURCE.read_text())


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiles the test program."""
    compiler = shutil.which(os.environ.get("CXX", "c++"))
    assert compiler is not None, "the build of flatland requires a C++ compiler"
    path = tmp_path_factory.mktemp("thread_pool") / "thread_pool_test"
    flags = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-pthread", f"-I{CORE}"]
    sources = [SOURCE, CORE / "parallel/thread_pool.cpp"]
    subprocess.run([compiler, *flags, *sources, "-o", path], check=True)
    return path


def test_the_program_has_tests() -> None:
    assert len(TESTS) >= 8


@pytest.mark.parametrize("name", TESTS)
def test_thread_pool(program: Path, name: str) -> None:
    run = subprocess.run([program, name], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr

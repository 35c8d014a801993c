"""Test programs in C++ of parts of the core that have no bindings."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from compiler import compile_program
from programs import run_program

CORE = Path(__file__).parents[2] / "src/cpp"
STANDARD = ["-std=c++17", f"-I{CORE}"]
POOL_TEST = Path(__file__).with_name("thread_pool_test.cpp")
POOL_TESTS = re.findall(r'\{"(\w+)", test_\w+\}', POOL_TEST.read_text())


@pytest.fixture(scope="module")
def pool_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tests of the thread pool."""
    program = tmp_path_factory.mktemp("thread_pool") / "thread_pool_test"
    flags = [*STANDARD, "-O1", "-Wall", "-Wextra", "-Werror", "-pthread"]
    return compile_program(program, [POOL_TEST, CORE / "parallel/thread_pool.cpp"], flags)


def test_there_are_tests_of_the_thread_pool() -> None:
    assert len(POOL_TESTS) >= 10


@pytest.mark.parametrize("name", POOL_TESTS)
def test_thread_pool(pool_program: Path, name: str) -> None:
    run_program([pool_program, name], check=True)


def test_random_numbers_of_the_core(tmp_path: Path) -> None:
    """Known answers of the generator, and the accuracy of normal numbers."""
    flags = [*STANDARD, "-O2", "-ffp-contract=off", "-Wno-psabi"]
    source = Path(__file__).with_name("random_kernel_test.cpp")
    program = compile_program(tmp_path / "random_kernel_test", [source], flags)
    run_program([program], check=True)


def test_search_for_new_pairs(tmp_path: Path) -> None:
    """The same contacts as Box2D finds, in the same order."""
    sources = [Path(__file__).with_name("broad_phase_test.cpp"), CORE / "world/broad_phase.cpp"]
    flags = [*STANDARD, "-O1", "-DB2_SHARED"]
    program = compile_program(tmp_path / "broad_phase_test", sources, flags, ["-lbox2d"])
    run_program([program], check=True)

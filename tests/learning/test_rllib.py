"""The program for RLlib in docs/learning.md."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
from pages import code_blocks


def test_the_environment_of_the_program_for_rllib_can_be_created():
    page = Path(__file__).resolve().parents[2] / "docs" / "learning.md"
    blocks = code_blocks(page.read_text(), "python")
    (program,) = (block for block in blocks if block.startswith("import ray\n"))
    (function,) = [node for node in ast.parse(program).body if isinstance(node, ast.FunctionDef)]
    names: dict[str, Any] = {}
    exec(compile(ast.Module([function], []), page.name, "exec"), names)
    environment = names[function.name]({"world": "corridor"})
    environment.reset(seed=1)
    observation, _, terminated, _, _ = environment.step(np.zeros(2, np.float32))
    assert environment.observation_space.contains(observation)
    assert not terminated
    environment.close()

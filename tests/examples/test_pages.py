"""Follows the pages whose examples are built step by step, as a reader would."""

from __future__ import annotations

import pytest
from pages import Shell, follow, read_page

PAGES = ["lockstep.md", "moving_over.md", "several_robots.md"]


@pytest.mark.ros
@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_print_the_documented_output(
    page, checkout, ros_environment, tmp_path, start
):
    blocks = read_page(checkout / "docs" / page)
    assert {block.kind for block in blocks} >= {"file", "run", "prints"}
    follow(blocks, Shell(ros_environment, tmp_path), start)

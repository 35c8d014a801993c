"""The groups of tests that run in one process."""

from __future__ import annotations

import pytest


def test_the_tests_of_a_file_are_a_group_of_pytest_xdist(request: pytest.FixtureRequest) -> None:
    if not hasattr(request.config, "workerinput"):
        pytest.skip("the tests run in one process")
    # pytest-xdist appends the group to the id; without it, it distributes the tests one by one.
    assert request.node.nodeid.endswith("@unit/test_groups.py")

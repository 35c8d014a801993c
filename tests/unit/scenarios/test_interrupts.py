"""Ctrl-C while foreign code runs."""

from __future__ import annotations

import signal

import pytest

from flatland.scenarios.interrupts import user_interrupts


def test_ctrl_c_differs_from_an_exception():
    with user_interrupts() as is_interrupted:
        with pytest.raises(KeyboardInterrupt):
            raise KeyboardInterrupt
        assert not is_interrupted()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert is_interrupted()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler

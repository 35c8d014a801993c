"""Faults of plugins, and which hooks are called at all."""

from __future__ import annotations

import logging
from types import SimpleNamespace

import pytest

from flatland import ModelPlugin, WorldPlugin
from flatland.runtime.plugin_costs import PluginCosts
from flatland.runtime.plugin_host import PluginHost, overrides


class Faulty(ModelPlugin):
    """Raises in the calls whose numbers are in `bad`."""

    def __init__(self, bad=()):
        self.name, self.type, self.model = "P", "my::Faulty", SimpleNamespace(name="M")
        self.ros = None
        self.bad = bad
        self.calls = 0

    def _detach(self):
        pass

    def before_physics_step(self, timekeeper):
        self.calls += 1
        if self.calls in self.bad:
            raise RuntimeError(f"fault {self.calls}")


def test_three_faults_in_a_row_disable_a_plugin(caplog):
    host = PluginHost()
    bad, good = Faulty(range(1, 99)), Faulty()
    host.add(bad)
    host.add(good)
    for _ in range(10):
        host.before_physics_step(None)
    assert (bad.calls, good.calls) == (3, 10)
    assert host.is_disabled(bad)
    assert not host.is_disabled(good)
    place = 'Model Plugin "P" type "my::Faulty" model "M"'
    assert f"{place}: before_physics_step raised 3 times in a row, the plugin is disabled" in (
        caplog.text
    )
    # The traceback once, not three times within a second.
    assert caplog.text.count("RuntimeError: fault") == 1
    assert f"{place}: before_physics_step raised\n" in caplog.text


def test_faults_that_are_not_in_a_row_are_forgiven():
    host = PluginHost()
    plugin = Faulty([1, 2, 4, 5, 7, 8])
    host.add(plugin)
    for _ in range(10):
        host.before_physics_step(None)
    assert plugin.calls == 10
    assert not host.is_disabled(plugin)


def test_only_overridden_hooks_are_called():
    plugin = Faulty()
    assert overrides(plugin, "before_physics_step")
    assert not overrides(plugin, "after_physics_step")
    assert not overrides(WorldPlugin(), "pre_solve")
    plugin.pre_solve = lambda contact, manifold: None
    assert overrides(plugin, "pre_solve")


def test_contacts_are_wanted_only_by_those_who_listen():
    class Listener(Faulty):
        def end_contact(self, contact):
            pass

    class Solver(Faulty):
        def pre_solve(self, contact, old_manifold):
            pass

    host = PluginHost()
    host.add(Faulty())
    assert (host.wants_contacts, host.wants_pre_solve) == (False, False)
    listener, solver = Listener(), Solver()
    host.add(listener)
    assert (host.wants_contacts, host.wants_pre_solve) == (True, False)
    host.add(solver)
    assert host.wants_pre_solve
    host.remove([listener, solver])
    assert (host.wants_contacts, host.wants_pre_solve) == (False, False)


@pytest.mark.parametrize("fails", [False, True])
def test_shut_down_closes_what_plugins_forget(fails, caplog):
    closed = []

    class Careless(Faulty):
        def on_shutdown(self):
            if fails:
                raise RuntimeError("will not go")

        def _detach(self):
            closed.append("ports")

    plugin = Careless()
    plugin.ros = SimpleNamespace(close=lambda: closed.append("ros"))
    host = PluginHost()
    host.add(plugin)
    caplog.set_level(logging.ERROR, "flatland")
    host.shut_down([plugin])
    assert closed == ["ros", "ports"]
    assert host.model_plugins == []
    assert ("on_shutdown raised" in caplog.text) is fails


def test_hooks_are_measured_while_costs_are_set():
    now = [0.0]

    class Slow(Faulty):
        def before_physics_step(self, timekeeper):
            now[0] += 1.0
            super().before_physics_step(timekeeper)

    host = PluginHost()
    # A hook that raises takes time as well, and so does one of a plugin that is added later.
    first, second = Slow([2, 3]), Slow()
    second.name = "Q"
    host.add(first)
    host.before_physics_step(None)
    costs = PluginCosts(lambda: now[0])
    host.measure(costs)
    host.add(second)
    for _ in range(4):
        host.before_physics_step(None)
    host.measure(None)
    host.before_physics_step(None)
    assert not host.is_disabled(first)
    assert costs.describe(100.0) == (
        'Model Plugin "P" type "my::Faulty" model "M" 4.0 %, '
        'Model Plugin "Q" type "my::Faulty" model "M" 4.0 %; by type: 2 x my::Faulty 8.0 %'
    )

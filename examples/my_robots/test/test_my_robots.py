"""Tests of the plugins, without ROS: python3 -m unittest discover -s test."""

import os
import unittest
from pathlib import Path

import flatland

PACKAGE = Path(__file__).resolve().parent.parent
# Also finds the plugins if the package is neither built nor on ROS_PACKAGE_PATH.
os.environ.setdefault("FLATLAND_PLUGIN_PATH", str(PACKAGE / "flatland_plugins.xml"))


class YardTest(unittest.TestCase):
    """A cart with a battery in a yard with a gate."""

    def setUp(self) -> None:
        """Loads the yard."""
        self.world = flatland.World.from_yaml(PACKAGE / "worlds" / "yard" / "world.yaml", seed=1)
        self.addCleanup(self.world.close)

    def drive(self, speed: float, seconds: float) -> float:
        """Drives for some time [s] and returns the x coordinate of the cart [m]."""
        self.world.command("/cmd_vel").set(flatland.Twist(linear_x=speed))
        self.world.step(round(seconds / 0.005))
        return self.world.model("cart").pose[0]

    def test_battery(self) -> None:
        """The power is -10 W at rest and -60 W at 1 m/s; the battery is charged with 200 W."""
        battery = self.world.output("/battery")
        self.drive(0.0, 9.0)
        self.assertAlmostEqual(battery.latest.energy, 2.0 - 10 * 9 / 3600)
        self.drive(1.0, 3.0)
        self.assertAlmostEqual(battery.latest.energy, 2.0 - (10 * 9 + 60 * 3) / 3600, places=6)
        self.world.command("/recharge").set(True)
        self.drive(0.0, 5.0)
        self.assertEqual(battery.latest.fraction, 1.0)

    def test_gate(self) -> None:
        """The cart passes from the -x side and is blocked on its way back."""
        self.assertGreater(self.drive(1.0, 6.0), 7.9)
        self.assertGreater(self.drive(-1.0, 6.0), 6.3)

    def test_reset(self) -> None:
        """The cart moves back to its initial pose."""
        start = self.world.model("cart").pose
        self.drive(1.0, 2.0)
        [reset] = self.world.plugins
        self.assertEqual(reset.reset(), ["cart"])
        self.assertEqual(self.world.model("cart").pose, start)


if __name__ == "__main__":
    unittest.main()

"""Controllers without learning, for any number of robots at once.

They are functions of what robots perceive in their own frames, as arrays with one row per robot.
`flatland.gym.controllers` computes these arrays from observations, and
`flatland.scenarios.controllers` from scan, pose and goal.
"""

from flatland.controllers.base import Capabilities as Capabilities
from flatland.controllers.base import Controller as Controller
from flatland.controllers.base import Perception as Perception
from flatland.controllers.dynamic_window import DynamicWindow as DynamicWindow
from flatland.controllers.gap import Gap as Gap
from flatland.controllers.straight import Straight as Straight

"""Images of a world with matplotlib, without ROS.

`capture` copies what is drawn out of a world, `layout` maps the world to pixels, `painter` draws
with matplotlib, and `render` provides the public functions.
"""

from flatland.drawing.layout import Layout
from flatland.drawing.render import (
    PICTURE_FORMATS,
    check_matplotlib,
    draw,
    draw_png,
    make_figure,
    save,
)

__all__ = [
    "PICTURE_FORMATS",
    "Layout",
    "check_matplotlib",
    "draw",
    "draw_png",
    "make_figure",
    "save",
]

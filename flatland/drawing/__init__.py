"""Images of a world with matplotlib, without ROS.

`flatland.scene` describes what is drawn, `layout` maps the world to pixels, `painter` draws with
matplotlib, and `render` provides the public functions. `frames` and `video` write videos.
"""

from flatland.drawing.frames import FrameRenderer
from flatland.drawing.layout import Layout
from flatland.drawing.render import (
    PICTURE_FORMATS,
    DrawOptions,
    check_matplotlib,
    draw,
    draw_png,
    make_figure,
    save,
)
from flatland.drawing.video import VIDEO_FORMATS, VideoFile, check_opencv

__all__ = [
    "PICTURE_FORMATS",
    "VIDEO_FORMATS",
    "DrawOptions",
    "FrameRenderer",
    "Layout",
    "VideoFile",
    "check_matplotlib",
    "check_opencv",
    "draw",
    "draw_png",
    "make_figure",
    "save",
]

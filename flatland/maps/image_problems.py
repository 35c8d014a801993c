"""Descriptions of map images whose walls or free space are probably missing.

Pixels of at least `occupied_thresh` are on, that is free, the others are off. An image without a
pixel that is off has no walls, and one without a pixel that is on is a solid block.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from flatland.maps.grey_image import GreyImage, ImageContent
from flatland.maps.map_image import lowest_on

_USUAL: Final = 0.65  # `occupied_thresh`
_LEAST_BRIGHT: Final = 64  # of the brightest pixel of an image that uses its range


def threshold_problem(image: ImageContent, occupied_thresh: float) -> str:
    """Returns what a threshold does that no map needs, empty for one between 0 and 1."""
    if 0 < occupied_thresh < 1:
        return ""
    count = image.grey.size
    text = f'"occupied_thresh" is {occupied_thresh:g}'
    if not 0 <= occupied_thresh <= 1:
        text += ", outside the range of pixel values, 0 to 1"
    if occupied_thresh <= 0:
        text += f": all {count} pixels are free, and there are no walls"
    elif occupied_thresh > 1:
        text += f": none of the {count} pixels is free"
    else:
        white = np.count_nonzero(image.grey == 255)
        text += f": only pixels of the value 255 are free, {white} of {count}"
    meant = _USUAL
    if 1 < occupied_thresh <= 100:
        meant = occupied_thresh / 100
    elif 100 < occupied_thresh <= 255:
        meant = occupied_thresh / 255
    return f"{text}; a value such as {meant:.3g} is required between dark walls and bright floor"


def image_problem(image: ImageContent, occupied_thresh: float) -> str:
    """Returns why the walls of an image are probably not those that were drawn.

    Args:
        image: The image.
        occupied_thresh: Threshold, between 0 and 1.

    Returns:
        What was found, the probable cause and the remedy; empty if nothing is suspicious.
    """
    lowest = lowest_on(occupied_thresh)
    count = image.grey.size
    low, high = int(image.grey.min()), int(image.grey.max())
    cause = _alpha_cause(image, lowest)
    if low < lowest <= high:
        return cause or _dark_cause(image, low, high, lowest)
    if high < lowest:
        found = f"none of the {count} pixels is free, so that the layer is a solid block"
    else:
        found = f"all {count} pixels are free, so that the layer has no walls"
    if not cause:
        cause = _range_cause(image, low, high, occupied_thresh)
    return f"{found}; {cause}"


def _alpha_cause(image: ImageContent, lowest: int) -> str:
    """Returns what alpha has to do with it, empty if it makes no difference."""
    if image.alpha is None:
        return ""
    is_transparent = image.alpha < 255
    grey, alpha = image.grey[is_transparent], image.alpha[is_transparent]
    is_on = grey >= lowest
    changed = np.zeros(grey.shape, bool)
    for background in (0, 255):
        changed |= (_blended(grey, alpha, background) >= lowest) != is_on
    if not changed.any():
        return ""
    return (
        f"{len(grey)} of {image.grey.size} pixels are transparent, but alpha is ignored, as in the "
        f"reference simulator: by the colors that are stored for them, {np.count_nonzero(is_on)} "
        f"are free and {np.count_nonzero(~is_on)} occupied; save the image without an alpha "
        "channel, on a white background"
    )


def _blended(grey: GreyImage, alpha: GreyImage, background: int) -> GreyImage:
    opacity = alpha.astype(np.uint16)
    mixed = grey * opacity + np.uint16(background) * (255 - opacity)
    return (mixed // 255).astype(np.uint8)


def _dark_cause(image: ImageContent, low: int, high: int, lowest: int) -> str:
    """Returns that even free pixels are dark, empty if they are not."""
    if high >= _LEAST_BRIGHT:
        return ""
    values = f"from {low} to {high} of 255"
    if image.peak is not None:
        values = f"at most {image.peak} of {image.scale}"
    free = np.count_nonzero(image.grey >= lowest)
    return (
        f"its values are {values}, only a low part of their range, and {free} of "
        f"{image.grey.size} pixels are free; scale the values to the whole range, with an "
        f'"occupied_thresh" of {_USUAL:g}'
    )


def _range_cause(image: ImageContent, low: int, high: int, occupied_thresh: float) -> str:
    """Returns what the range of values has to do with it.

    Args:
        image: The image.
        low: Smallest grey value.
        high: Largest grey value.
        occupied_thresh: Threshold.
    """
    threshold = occupied_thresh * 255
    if image.peak is not None and image.peak < occupied_thresh * image.scale:
        return (
            f"its values have 16 bits, and are at most {image.peak} of {image.scale}, where "
            f'"occupied_thresh" is {occupied_thresh * image.scale:.6g}; save it with 8 bits, or '
            f"scale the values to the range 0 to {image.scale}"
        )
    values = f"its values are {low}" if low == high else f"its values are from {low} to {high}"
    found = f'{values} of 255, where "occupied_thresh" is {threshold:.6g}'
    if low == high:
        return f"{found}; draw walls dark and free space bright"
    if high < threshold:
        return f'{found}; scale them to the range 0 to 255, or lower "occupied_thresh"'
    return f'{found}; draw walls darker, or raise "occupied_thresh"'

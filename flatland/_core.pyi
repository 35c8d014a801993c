"""The extension: Box2D behind handles, for flatland.physics; maps for flatland.bitmap."""

import numpy as np
import numpy.typing as npt

# --- map_edges.cpp: from a bitmap to its boundary (flatland.bitmap documents them) ---

def boundary_edges(
    mask: npt.NDArray[np.bool_] | npt.NDArray[np.uint8], resolution: float
) -> npt.NDArray[np.float32]: ...
def boundary_loops(
    mask: npt.NDArray[np.bool_] | npt.NDArray[np.uint8],
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int64]]: ...

// Masks as arguments, and the functions that take them.
#pragma once

#include <pybind11/numpy.h>

#include "maps/map_edges.h"

namespace flatland {

// Checks the shape and type of a mask and returns it in C order, without a copy if possible.
pybind11::array checked_mask(const pybind11::array& mask);

Bitmap view_of(const pybind11::array& mask);

void bind_masks(pybind11::module_& module);

}  // namespace flatland

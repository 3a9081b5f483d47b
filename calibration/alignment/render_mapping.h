// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "alignment/camera_parameters.h"
#include "alignment/rendered_view.h"
#include "image/image.h"

namespace truebox {

/// For each pixel of a render, where a photograph of `width` x `height` pixels taken by this camera
/// shows what its centre shows: channels "x_px" and "y_px". NaN where that is nothing, lies off the
/// photograph, or is hidden there: the point of another surface falls on the same spot (two pixels
/// of the render) and is nearer by over 3 %. What the render itself does not show hides nothing.
Image photo_from_render(const RenderedView& view, const CameraParameters& parameters, int width,
                        int height);

/// The photograph, proportional to light, in the render's pixels: the mean over what each of them
/// covers, bilinear between the photograph's. NaN where the mapping is.
Image in_render_pixels(const Image& photograph, const Image& photo_from_render);

}  // namespace truebox

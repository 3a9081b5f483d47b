// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"
#include "radiometry/observer.h"

namespace truebox {

/// What stands behind a "±": a standard deviation (k = 1), or a bound on the error. Never mixed.
enum class UncertaintyKind { none, standard, bound };

/// One band or channel of an image set.
struct ImageBand {
  std::string name;             ///< as the reference names it
  double wavelength_nm = -1.0;  ///< centre; negative for a channel that is no spectral band
  std::array<double, 3>
      linear_rgb{};  ///< what a unit of it adds to linear BT.709; 0: not for colour
};

/// Two images of the same pixels, band by band, packed for a page in which a reader looks around.
/// Planes of width x height samples, row by row from the top left: for each band the test, the
/// reference, u of the test and u of the reference where there is one; last the surface of each
/// pixel (0: none, n: surfaces[n - 1]) where there are surfaces. Samples are halves (IEEE 754
/// binary16) times a power of two: rounded by at most 2^-11 of their value, u by 2^-7, which keeps
/// its two significant digits. `packed`: of each plane the bit patterns, less those of the band
/// before modulo 2^16, first all low bytes, then all high bytes; all planes as one zlib stream
/// (RFC 1950).
struct ImageSet {
  int width_px = 0;  ///< of the planes
  int height_px = 0;
  int stride = 1;        ///< n: every n-th pixel in x and in y is here, beginning with (0, 0)
  std::string quantity;  ///< "radiance"
  std::string unit;      ///< of all bands
  std::string test_name, reference_name;  ///< "Prediction (simulated)", "Photograph"
  UncertaintyKind test_uncertainty = UncertaintyKind::none;
  UncertaintyKind reference_uncertainty = UncertaintyKind::none;
  double exposure = 1.0;  ///< display = exposure x value, before the reader changes it
  std::vector<ImageBand> bands;
  std::vector<int> scale_exponents;  ///< a sample of plane p is its half times 2^scale_exponents[p]
  std::vector<std::string> surfaces;
  std::vector<std::uint8_t> packed;

  std::size_t planes_per_band() const;
  std::size_t plane_count() const;  ///< surfaces included
};

/// One of the two images, with what its samples are uncertain by.
struct ImageSide {
  std::string name;
  const Image* image = nullptr;
  const Image* uncertainty = nullptr;  ///< same bands; nullptr where nobody stated one
  UncertaintyKind kind = UncertaintyKind::standard;
};

struct ImageSetOptions {
  std::string quantity = "radiance";
  double exposure = 1.0;
  const Observer* observer = nullptr;     ///< gives spectral bands a colour
  std::span<const int> surface_of_pixel;  ///< index into `surfaces`, negative for none; or empty
  std::vector<std::string> surfaces;
  std::size_t most_bytes = 6'500'000;  ///< of `packed`; beyond it only every n-th pixel is kept
};

/// Packs two images whose bands agree (by wavelength where both are spectral, else by name: see
/// difference_map). Channels R, G, B are shown as colours. What is not finite stays so; samples
/// below 2^-30 of their plane's largest lose digits.
/// Throws MismatchError on other sizes, bands or units.
ImageSet make_image_set(const ImageSide& test, const ImageSide& reference,
                        const ImageSetOptions& options = {});

/// One plane again, as the page reads it. Throws std::invalid_argument if the packed bytes are not
/// what the rest of the set says.
std::vector<float> unpack_plane(const ImageSet& set, std::size_t plane);

/// Why a set (from a stranger's JSON) cannot be shown, or "": sizes that do not fit together,
/// bytes that are no zlib stream of the right length.
std::string image_set_objection(const ImageSet& set);

}  // namespace truebox

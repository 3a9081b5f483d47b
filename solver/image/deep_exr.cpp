// SPDX-License-Identifier: BSD-3-Clause
#include "image/deep_exr.h"

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputPart.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "image/codecs.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr std::size_t kNone = ~std::size_t{0};

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? kNone : static_cast<std::size_t>(found - names.begin());
}

// The samples of one row of pixels, and what is seen of them.
class DeepRow {
 public:
  DeepRow(const std::filesystem::path& path, const Imf::Header& header)
      : path_(path), left_(header.dataWindow().min.x) {
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
      names_.emplace_back(it.name());
    z_ = index_of(names_, "Z");
    z_back_ = index_of(names_, "ZBack");
    alpha_ = index_of(names_, "A");
    if (z_ == kNone)
      throw InputError(path.string(), 0, "deep samples with their depth, channel Z", "none");
    const auto width = static_cast<std::size_t>(header.dataWindow().max.x - left_ + 1);
    counts_.resize(width);
    first_.resize(names_.size() * width);
  }

  void read(Imf::DeepScanLineInputPart& part, int y) {
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, base(counts_.data()), sizeof(unsigned), 0));
    const std::size_t width = counts_.size();
    for (std::size_t c = 0; c < names_.size(); ++c)
      buffer.insert(names_[c], Imf::DeepSlice(Imf::FLOAT, base(first_.data() + c * width),
                                              sizeof(float*), 0, sizeof(float)));
    part.setFrameBuffer(buffer);
    part.readPixelSampleCounts(y);
    const std::size_t total = std::accumulate(counts_.begin(), counts_.end(), std::size_t{0});
    codecs::require_believable_size(path_,
                                    static_cast<std::int64_t>(std::max<std::size_t>(total, 1)), 1,
                                    static_cast<std::int64_t>(names_.size()));
    samples_.resize(total * names_.size());
    float* next = samples_.data();
    for (std::size_t c = 0; c < names_.size(); ++c)
      for (std::size_t x = 0; x < width; ++x) {
        first_[c * width + x] = next;
        next += counts_[x];
      }
    part.readPixels(y);
  }

  // Appends what is seen of pixel x to the planes.
  void flatten(std::size_t x, std::vector<std::vector<float>>& planes) {
    order_.resize(counts_[x]);
    std::iota(order_.begin(), order_.end(), 0u);
    std::sort(order_.begin(), order_.end(), [&](unsigned a, unsigned b) {
      return std::pair(at(z_, x, a), back(x, a)) < std::pair(at(z_, x, b), back(x, b));
    });
    for (std::size_t k = 1; k < order_.size(); ++k)
      if (back(x, order_[k - 1]) > at(z_, x, order_[k]))
        throw InputError(path_.string(), 0, "deep samples that do not overlap in depth",
                         "volumes that do");
    for (std::size_t c = 0; c < names_.size(); ++c) {
      const bool is_depth = c == z_ || c == z_back_;
      double seen = 0.0, clear = 1.0;
      for (unsigned k : order_) {
        seen += clear * static_cast<double>(at(c, x, k));
        if (is_depth) break;
        clear *= alpha_ == kNone ? 0.0 : 1.0 - static_cast<double>(at(alpha_, x, k));
        if (clear <= 0.0) break;
      }
      planes[c].push_back(static_cast<float>(seen));
    }
  }

  std::size_t channels() const { return names_.size(); }
  std::size_t width() const { return counts_.size(); }

 private:
  template <class T>
  char* base(T* row) const {
    return reinterpret_cast<char*>(row - left_);
  }
  float at(std::size_t channel, std::size_t x, unsigned sample) const {
    return first_[channel * counts_.size() + x][sample];
  }
  float back(std::size_t x, unsigned sample) const {
    return at(z_back_ == kNone ? z_ : z_back_, x, sample);
  }

  const std::filesystem::path& path_;
  int left_;
  std::vector<std::string> names_;
  std::size_t z_, z_back_, alpha_;
  std::vector<unsigned> counts_, order_;
  std::vector<float*> first_;  // channels x width
  std::vector<float> samples_;
};

}  // namespace

std::vector<std::vector<float>> codecs::read_flattened(const std::filesystem::path& path,
                                                       int index) {
  Imf::MultiPartInputFile file(path.c_str());
  const Imf::Header& header = file.header(index);
  if (header.type() != Imf::DEEPSCANLINE)
    throw InputError(path.string(), 0, "deep images in scan lines", "deep tiles");
  Imf::DeepScanLineInputPart part(file, index);
  DeepRow row(path, header);
  std::vector<std::vector<float>> planes(row.channels());
  for (int y = header.dataWindow().min.y; y <= header.dataWindow().max.y; ++y) {
    row.read(part, y);
    for (std::size_t x = 0; x < row.width(); ++x) row.flatten(x, planes);
  }
  return planes;
}

}  // namespace truebox

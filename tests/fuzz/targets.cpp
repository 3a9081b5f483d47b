// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/targets.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "document/writers.h"
#include "image/image_file.h"
#include "provenance/provenance.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"
#include "readings/measurement_file.h"
#include "scene/scene_file.h"

namespace truebox {
namespace {

void image(const std::string& path) {
  const Image read = read_image(path);
  for (const Channel& channel : read.channels)
    if (channel.samples.size() != read.pixel_count())
      throw std::logic_error("a channel with other than the image's samples");
}

void scene(const std::string& path) { read_scene(path); }

void measurement(const std::string& path) { read_measurement(path); }

void table(const std::string& path) {
  const TableFile read = read_table(path);
  for (const std::string& column : read.columns) spectrum_from_table(read, column);
}

void report(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const Report read = from_json(text, path);
  // What was accepted can be shown, and is the same when read again.
  if (to_html(read).empty() || to_json(from_json(to_json(read), path)) != to_json(read))
    throw std::logic_error("a report that does not survive its own JSON");
  to_junit(read);
  to_markdown(read);
}

/// A folder of this process with copies of what scene and measurement files name.
const std::filesystem::path& folder() {
  struct Folder {
    std::filesystem::path path = base() / ("truebox_fuzz_" + std::to_string(::getpid()));
    /// In memory where that can be: thousands of small files are written.
    static std::filesystem::path base() {
      return ::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : std::filesystem::temp_directory_path();
    }
    Folder() {
      std::filesystem::create_directories(path);
      for (const char* from : {"cornell_box", "llanos_narrowband"})
        for (const auto& entry : std::filesystem::directory_iterator(
                 std::filesystem::path(TRUEBOX_REFERENCE_DIR) / from))
          if (const auto copy = path / entry.path().filename(); !std::filesystem::exists(copy))
            std::filesystem::create_symlink(entry.path(), copy);
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder kept;
  return kept.path;
}

}  // namespace

const std::vector<FuzzTarget>& fuzz_targets() {
  static const std::vector<FuzzTarget> kTargets = {{"image", &image, "fuzz.bin"},
                                                   {"scene", &scene, "fuzz_scene.toml"},
                                                   {"measurement", &measurement, "fuzz.toml"},
                                                   {"table", &table, "fuzz.csv"},
                                                   {"report", &report, "fuzz.json"}};
  return kTargets;
}

std::string run_target(const FuzzTarget& target, std::span<const std::uint8_t> bytes) {
  const std::string path = (folder() / target.file_name).string();
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  try {
    target.read(path);
  } catch (const InputError&) {
  } catch (const MismatchError&) {
  } catch (const std::invalid_argument&) {
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "scene/generated_scene.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <numbers>
#include <random>
#include <sstream>
#include <stdexcept>

#include "scene/polygon.h"

namespace truebox {
namespace {

constexpr double kWall_m = 0.3;  // between rooms
constexpr std::size_t kPatchesASurface = 40;
constexpr std::size_t kSurfacesOfAMuseumRoom = 84, kSurfacesOfAHall = 199;

constexpr char kMaterials[] = R"([bands]
centres_nm = [450, 550, 650]

[materials.plaster]
reflectance = { nm = [450, 550, 650], value = [0.70, 0.74, 0.75] }
[materials.floor]
reflectance = { nm = [450, 550, 650], value = [0.18, 0.26, 0.34] }
[materials.concrete]
reflectance = { nm = [450, 550, 650], value = [0.40, 0.43, 0.44] }
[materials.blue]
reflectance = { nm = [450, 550, 650], value = [0.50, 0.25, 0.10] }
[materials.green]
reflectance = { nm = [450, 550, 650], value = [0.12, 0.45, 0.15] }
[materials.red]
reflectance = { nm = [450, 550, 650], value = [0.06, 0.09, 0.55] }
[materials.skylight]
reflectance = 0.2
exitance = { nm = [450, 550, 650], value = [1.15, 1.10, 0.95] }
[materials.lamp]
reflectance = 0.5
exitance = { nm = [450, 550, 650], value = [3.0, 4.0, 5.0] }
)";

// A wall's door: from `from` to `to` along the wall, `height` high.
struct Door {
  double from, to, height;
};

struct Room {
  double x0, y0, x1, y1, height;
};

class Writer {
 public:
  explicit Writer(const GeneratedSceneOptions& options) : random_(options.seed) {
    text_.imbue(std::locale::classic());
    text_ << "# " << options.kind << ", made for " << options.patches << " patches, seed "
          << options.seed << "\nlength_unit = \"m\"\n\n"
          << kMaterials;
  }

  std::string text() const { return text_.str(); }

  double between(double low, double high) {  // std's distributions differ by implementation
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  const char* colour() {
    static const char* const kColours[] = {"blue", "green", "red", "plaster", "concrete"};
    return kColours[random_() % 5];
  }

  void add(const std::string& name, const std::string& material, const Polygon& polygon) {
    text_ << "\n[[surfaces]]\nname = \"" << name << ' ' << ++count_ << "\"\nmaterial = \""
          << material << "\"\nvertices = [";
    for (std::size_t k = 0; k < polygon.size(); ++k)
      text_ << (k ? ", [" : "[") << std::setprecision(10) << polygon[k].x() << ", "
            << polygon[k].y() << ", " << polygon[k].z() << ']';
    text_ << "]\n";
  }

  // A horizontal rectangle, lit from above or from below.
  void add_level(const std::string& name, const std::string& material, const Room& r, double z,
                 bool up) {
    Polygon p = {{r.x0, r.y0, z}, {r.x1, r.y0, z}, {r.x1, r.y1, z}, {r.x0, r.y1, z}};
    if (!up) std::reverse(p.begin(), p.end());
    add(name, material, p);
  }

  // An upright rectangle from a to b, lit on the left of that direction.
  void add_upright(const std::string& name, const std::string& material, const Vec3& a,
                   const Vec3& b, double z0, double z1) {
    add(name, material,
        {{b.x(), b.y(), z0}, {a.x(), a.y(), z0}, {a.x(), a.y(), z1}, {b.x(), b.y(), z1}});
  }

  // A wall with at most one door, as rectangles; the room is on the left.
  void add_wall(const Vec3& a, const Vec3& b, double height, const Door* door) {
    if (!door) return add_upright("wall", "plaster", a, b, 0.0, height);
    const Vec3 along = (b - a).normalized();
    const Vec3 from = a + door->from * along, to = a + door->to * along;
    add_upright("wall", "plaster", a, from, 0.0, height);
    add_upright("wall", "plaster", to, b, 0.0, height);
    add_upright("lintel", "plaster", from, to, door->height, height);
  }

  // The thickness of the wall around a door: from one room's side to the other's.
  void add_reveal(const Room& r, double height, bool along_x) {
    add_level("sill", "floor", r, 0.0, true);
    add_level("soffit", "plaster", r, height, false);
    if (along_x) {
      add_upright("jamb", "plaster", {r.x0, r.y0, 0}, {r.x1, r.y0, 0}, 0.0, height);
      add_upright("jamb", "plaster", {r.x1, r.y1, 0}, {r.x0, r.y1, 0}, 0.0, height);
    } else {
      add_upright("jamb", "plaster", {r.x0, r.y1, 0}, {r.x0, r.y0, 0}, 0.0, height);
      add_upright("jamb", "plaster", {r.x1, r.y0, 0}, {r.x1, r.y1, 0}, 0.0, height);
    }
  }

  // A ceiling with `strips` equal luminous rectangles in a row along x.
  void add_ceiling(const Room& r, int strips, const Vec3& light, const std::string& material) {
    const double z = r.height, middle = 0.5 * (r.y0 + r.y1);
    const double y0 = middle - 0.5 * light.y(), y1 = middle + 0.5 * light.y();
    add_level("ceiling", "plaster", {r.x0, r.y0, r.x1, y0, z}, z, false);
    add_level("ceiling", "plaster", {r.x0, y1, r.x1, r.y1, z}, z, false);
    const double step = (r.x1 - r.x0) / strips;
    double x = r.x0;
    for (int k = 0; k < strips; ++k) {
      const double x0 = r.x0 + (k + 0.5) * step - 0.5 * light.x();
      add_level("ceiling", "plaster", {x, y0, x0, y1, z}, z, false);
      add_level(material, material, {x0, y0, x0 + light.x(), y1, z}, z, false);
      x = x0 + light.x();
    }
    add_level("ceiling", "plaster", {x, y0, r.x1, y1, z}, z, false);
  }

  // Eight sides from floor to ceiling.
  void add_column(double x, double y, double radius, double height) {
    const auto corner = [&](int k) -> Vec3 {
      const double angle = (k + 0.5) * std::numbers::pi / 4.0;
      return {x + radius * std::cos(angle), y + radius * std::sin(angle), 0.0};
    };
    for (int k = 0; k < 8; ++k)
      add_upright("column", "concrete", corner(k + 1), corner(k), 0.0, height);
  }

  // Four sides and a lid; nothing beneath.
  void add_block(const std::string& name, const std::string& material, const Room& r, double z) {
    add_upright(name, material, {r.x1, r.y0, 0}, {r.x0, r.y0, 0}, z, r.height);
    add_upright(name, material, {r.x1, r.y1, 0}, {r.x1, r.y0, 0}, z, r.height);
    add_upright(name, material, {r.x0, r.y1, 0}, {r.x1, r.y1, 0}, z, r.height);
    add_upright(name, material, {r.x0, r.y0, 0}, {r.x0, r.y1, 0}, z, r.height);
    add_level(name + " lid", material, r, r.height, true);
  }

  void add_camera(const Vec3& at, const Vec3& towards) {
    text_ << "\n[cameras.inside]\nposition = [" << at.x() << ", " << at.y() << ", " << at.z()
          << "]\ndirection = [" << towards.x() << ", " << towards.y() << ", " << towards.z()
          << "]\nup = [0, 0, 1]\nfocal_length_mm = 20\nfilm_mm = [36, 24]\npixels = [480, 320]\n";
  }

 private:
  std::ostringstream text_;
  std::mt19937_64 random_;
  int count_ = 0;
};

void add_museum_room(Writer& w, const Room& r, const Door* const doors[4]) {
  w.add_level("floor", "floor", r, 0.0, true);
  const Vec3 a(r.x0, r.y0, 0), b(r.x1, r.y0, 0), c(r.x1, r.y1, 0), d(r.x0, r.y1, 0);
  w.add_wall(a, b, r.height, doors[0]);
  w.add_wall(b, c, r.height, doors[1]);
  w.add_wall(c, d, r.height, doors[2]);
  w.add_wall(d, a, r.height, doors[3]);
  const double size = w.between(2.5, 4.0);
  w.add_ceiling(r, 1, {size, size, 0}, "skylight");
  for (double x : {0.28, 0.72})
    for (double y : {0.28, 0.72})
      w.add_column(r.x0 + x * (r.x1 - r.x0), r.y0 + y * (r.y1 - r.y0), 0.25, r.height);
  // Pedestals in the free squares between columns and walls, clear of the doors' axes.
  for (double x : {1.3, 8.7})
    for (double y : {1.3, 8.7}) {
      const double px = r.x0 + x + w.between(-0.3, 0.3), py = r.y0 + y + w.between(-0.3, 0.3);
      const double half = w.between(0.3, 0.45), top = w.between(0.8, 1.2);
      w.add_block("pedestal", "plaster", {px - half, py - half, px + half, py + half, top}, 0.0);
    }
  for (double y : {3.4, 6.6}) {
    const double px = r.x0 + 5.0 + w.between(-0.6, 0.6), py = r.y0 + y + w.between(-0.3, 0.3);
    const double hx = w.between(0.5, 0.8), hy = w.between(0.3, 0.5), top = w.between(0.9, 1.9);
    w.add_block("exhibit", w.colour(), {px - hx, py - hy, px + hx, py + hy, top}, 0.0);
  }
}

std::string museum(const GeneratedSceneOptions& options) {
  Writer w(options);
  const double rooms =
      static_cast<double>(options.patches) / (kPatchesASurface * kSurfacesOfAMuseumRoom);
  const int columns = std::max(1, static_cast<int>(std::lround(std::sqrt(rooms))));
  const int rows = std::max(1, static_cast<int>(std::lround(rooms / columns)));
  const double size = 10.0, height = 5.0, step = size + kWall_m;
  const Door door{4.2, 5.8, 2.4};
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const Room r{i * step, j * step, i * step + size, j * step + size, height};
      const Door* const doors[4] = {j > 0 ? &door : nullptr, i + 1 < columns ? &door : nullptr,
                                    j + 1 < rows ? &door : nullptr, i > 0 ? &door : nullptr};
      add_museum_room(w, r, doors);
      if (doors[1])
        w.add_reveal({r.x1, r.y0 + door.from, r.x1 + kWall_m, r.y0 + door.to, 0}, door.height,
                     true);
      if (doors[2])
        w.add_reveal({r.x0 + door.from, r.y1, r.x0 + door.to, r.y1 + kWall_m, 0}, door.height,
                     false);
    }
  w.add_camera({0.8, 5.0, 1.7}, {1.0, 0.0, -0.05});
  return w.text();
}

void add_office(Writer& w, const Room& r, const Door& door) {
  w.add_level("floor", "floor", r, 0.0, true);
  const Vec3 a(r.x0, r.y0, 0), b(r.x1, r.y0, 0), c(r.x1, r.y1, 0), d(r.x0, r.y1, 0);
  w.add_wall(a, b, r.height, &door);
  w.add_wall(b, c, r.height, nullptr);
  w.add_wall(c, d, r.height, nullptr);
  w.add_wall(d, a, r.height, nullptr);
  w.add_ceiling(r, 1, {0.6, 1.5, 0}, "lamp");
  w.add_block("desk", "plaster", {r.x0 + 1.0, r.y1 - 2.0, r.x0 + 2.6, r.y1 - 1.2, 0.75}, 0.0);
}

void add_machine(Writer& w, double x, double y) {
  const double hx = w.between(1.0, 1.6), hy = w.between(0.7, 1.2), z = w.between(0.8, 1.4);
  w.add_block("machine", "concrete", {x - hx, y - hy, x + hx, y + hy, z}, 0.0);
  const double sx = w.between(0.4, 0.8) * hx, sy = w.between(0.4, 0.8) * hy;
  w.add_block("machine", w.colour(), {x - sx, y - sy, x + sx, y + sy, z + w.between(0.6, 1.8)}, z);
}

std::string factory(const GeneratedSceneOptions& options) {
  Writer w(options);
  const int halls =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(options.patches) /
                                               (kPatchesASurface * kSurfacesOfAHall))));
  const double length = 30.0, width = 18.0, height = 8.0, step = length + kWall_m;
  const Door gate{6.5, 11.5, 4.5};
  const double office_width = 6.0, office_height = 3.0;
  const Door office_door{2.0, 3.0, 2.1};
  for (int h = 0; h < halls; ++h) {
    const Room r{h * step, 0.0, h * step + length, width, height};
    w.add_level("floor", "floor", r, 0.0, true);
    const Vec3 a(r.x0, r.y0, 0), b(r.x1, r.y0, 0), c(r.x1, r.y1, 0), d(r.x0, r.y1, 0);
    w.add_wall(a, b, height, nullptr);
    w.add_wall(b, c, height, h + 1 < halls ? &gate : nullptr);
    const Door back{width - gate.to, width - gate.from, gate.height};
    w.add_wall(d, a, height, h > 0 ? &back : nullptr);
    if (h + 1 < halls)
      w.add_reveal({r.x1, gate.from, r.x1 + kWall_m, gate.to, 0}, gate.height, true);
    // Two offices behind the long wall, a door each; the wall runs from c to d.
    const Vec3 middle = 0.5 * (c + d);
    for (int k = 0; k < 2; ++k) {
      const double x0 = r.x0 + (k == 0 ? 4.0 : 19.0);
      const Room office{x0, r.y1 + kWall_m, x0 + office_width, r.y1 + kWall_m + 5.0, office_height};
      const Vec3 from = k == 0 ? middle : c, to = k == 0 ? d : middle;
      const double along = from.x() - (x0 + office_door.to);
      const Door seen{along, along + office_door.to - office_door.from, office_door.height};
      w.add_wall(from, to, height, &seen);
      add_office(w, office, office_door);
      w.add_reveal({x0 + office_door.from, r.y1, x0 + office_door.to, r.y1 + kWall_m, 0},
                   office_door.height, false);
    }
    w.add_ceiling(r, 4, {2.5, 12.0, 0}, "skylight");
    for (double x : {5.0, 15.0, 25.0})
      for (double y : {4.0, 14.0}) w.add_column(r.x0 + x, y, 0.3, height);
    for (double x : {2.5, 10.0, 20.0, 27.5})
      for (double y : {3.0, 15.0})
        add_machine(w, r.x0 + x + w.between(-0.2, 0.2), y + w.between(-0.4, 0.4));
  }
  w.add_camera({1.0, 9.0, 3.0}, {1.0, 0.0, -0.08});
  return w.text();
}

}  // namespace

std::vector<std::string> generated_scene_kinds() { return {"factory", "museum"}; }

std::string GeneratedSceneOptions::invalid() const {
  const auto kinds = generated_scene_kinds();
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
    return "no scene is called \"" + kind + "\"";
  if (patches < 1000 || patches > 10000000) return "1000 to 10000000 patches expected";
  return {};
}

std::string generated_scene(const GeneratedSceneOptions& options) {
  if (const std::string why = options.invalid(); !why.empty()) throw std::invalid_argument(why);
  return options.kind == "museum" ? museum(options) : factory(options);
}

}  // namespace truebox

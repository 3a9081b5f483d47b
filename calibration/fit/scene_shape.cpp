// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace truebox {

using Eigen::Index;

namespace {

constexpr double kCameraStep_px = 0.02;  // exact areas: rounding is 1e-12 of it
constexpr double kSurfaceStep = 5e-4;    // of the diagonal: form factors are good to 1e-5
constexpr double kReach = 50.0;          // sizes; combinations of them may move little
constexpr double kSurfaceSize = 0.01;    // of the diagonal

const char* const kNames[] = {"tilt",
                              "pan",
                              "roll",
                              "right",
                              "down",
                              "forward",
                              "focal length",
                              "principal point x",
                              "principal point y",
                              "k1",
                              "k2",
                              "p1",
                              "p2",
                              "k3"};

Vec3 centre_of(const Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const Surface& s : scene.surfaces)
    for (const Polygon& piece : s.pieces)
      for (const Vec3& v : piece) box.extend(v);
  return box.center();
}

/// How much of a term moves the picture's rim by 1 px.
double one_px(const CameraDescription& camera, CameraTerm term, const Vec3& centre_m) {
  const auto pitch = camera.pixel_pitch_m();
  const double focal_px = camera.focal_length_m / pitch[0];
  const double half_px = 0.5 * std::hypot(camera.pixels[0], camera.pixels[1]);
  const double r = half_px / focal_px;
  const double distance_mm = 1e3 * (centre_m - camera.position_m).norm();
  switch (term) {
    case CameraTerm::tilt:
    case CameraTerm::pan: return 1.0 / focal_px;
    case CameraTerm::roll: return 1.0 / half_px;
    case CameraTerm::right:
    case CameraTerm::down: return distance_mm / focal_px;
    case CameraTerm::forward: return distance_mm / half_px;
    case CameraTerm::focal_length: return 1e3 * camera.focal_length_m / half_px;
    case CameraTerm::principal_point_x:
    case CameraTerm::principal_point_y: return 1.0;
    case CameraTerm::k1: return 1.0 / (focal_px * std::pow(r, 3));
    case CameraTerm::k2: return 1.0 / (focal_px * std::pow(r, 5));
    case CameraTerm::k3: return 1.0 / (focal_px * std::pow(r, 7));
    case CameraTerm::p1:
    case CameraTerm::p2: return 1.0 / (3.0 * focal_px * r * r);
  }
  return 1.0;
}

double* lens_term(CameraDescription& camera, CameraTerm term) {
  LensDistortion& d = camera.lens.distortion;
  switch (term) {
    case CameraTerm::k1: return &d.k1;
    case CameraTerm::k2: return &d.k2;
    case CameraTerm::p1: return &d.p1;
    case CameraTerm::p2: return &d.p2;
    case CameraTerm::k3: return &d.k3;
    default: return nullptr;
  }
}

/// Turns and moves of one camera together: about and along the axes of the scene file's camera.
void move_camera(CameraDescription& camera, const Vec3& turn_rad, const Vec3& move_m) {
  Eigen::Matrix3d axes;  // columns: right, down, forward
  axes.col(2) = camera.direction.normalized();
  axes.col(0) = camera.direction.cross(camera.up).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  camera.position_m += axes * move_m;
  const double angle = turn_rad.norm();
  if (!(angle > 0.0)) return;
  const Eigen::AngleAxisd turn(angle, axes * (turn_rad / angle));
  camera.direction = turn * axes.col(2);
  camera.up = turn * Vec3(-axes.col(1));
}

}  // namespace

std::string to_string(CameraTerm term) { return kNames[static_cast<std::size_t>(term)]; }

const char* unit_of(CameraTerm term) {
  if (term <= CameraTerm::roll) return "rad";
  if (term <= CameraTerm::focal_length) return "mm";
  return term <= CameraTerm::principal_point_y ? "px" : "1";
}

const char* ShapeUnknown::unit() const {
  return !camera.empty() ? unit_of(term) : stretch.isZero() ? "mm" : "1";
}

ShapeUnknown camera_unknown(const Scene& scene, const std::string& camera, CameraTerm term) {
  CameraDescription description = scene.cameras.at(camera);
  const auto pitch = description.pixel_pitch_m();
  ShapeUnknown unknown;
  unknown.camera = camera;
  unknown.term = term;
  const bool is_pose = term <= CameraTerm::forward;
  const bool turns = term <= CameraTerm::roll;
  unknown.name = {"camera " + camera + ", " + to_string(term),
                  (turns     ? "direction of camera "
                   : is_pose ? "position of camera "
                             : to_string(term) + " of camera ") +
                      camera + (is_pose ? " (" + to_string(term) + ")" : ""),
                  is_pose ? "poses" : "lens coefficients"};
  if (term == CameraTerm::focal_length) unknown.known = 1e3 * description.focal_length_m;
  for (std::size_t k = 0; k < 2; ++k)
    if (term == (k == 0 ? CameraTerm::principal_point_x : CameraTerm::principal_point_y))
      unknown.known =
          0.5 * description.pixels[k] + description.lens.principal_point_m[k] / pitch[k];
  if (const double* coefficient = lens_term(description, term)) unknown.known = *coefficient;
  return unknown;
}

bool ShapedScene::moves_surfaces() const {
  return std::any_of(unknowns.begin(), unknowns.end(),
                     [](const ShapeUnknown& u) { return u.moves_surfaces(); });
}

double ShapedScene::size_of(std::size_t k) const {
  const ShapeUnknown& u = unknowns[k];
  if (u.moves_surfaces())
    return kSurfaceSize * (u.stretch.isZero() ? 1e3 * original.diameter_m() : 1.0);
  return one_px(original.cameras.at(u.camera), u.term, centre_of(original));
}

double ShapedScene::motion_px(const std::vector<double>& from,
                              const std::vector<double>& to) const {
  double surface_share = 0.0;
  for (std::size_t k = 0; k < unknowns.size(); ++k)
    if (unknowns[k].moves_surfaces())
      surface_share =
          std::max(surface_share, kSurfaceSize * std::abs(to[k] - from[k]) / size_of(k));
  double largest_px = 0.0;
  const Vec3 centre = centre_of(original);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Camera before(camera(from, v)), after(camera(to, v));
    const auto [width, height] = views[v].pixels;
    const double distance_m = (centre - camera(from, v).position_m).norm();
    double camera_px = 0.0;
    constexpr int kGrid = 8;
    for (int j = 0; j <= kGrid; ++j)
      for (int i = 0; i <= kGrid; ++i) {
        const PixelPosition at{static_cast<double>(width) * i / kGrid,
                               static_cast<double>(height) * j / kGrid};
        const auto ray = before.ray(at);
        if (!ray) continue;
        const auto seen = after.project(ray->origin_m + distance_m * ray->direction);
        if (seen.outcome == LensOutcome::ok)
          camera_px = std::max(
              camera_px, std::hypot(seen.position.x_px - at.x_px, seen.position.y_px - at.y_px));
      }
    // A picture shows about the whole scene.
    largest_px = std::max(largest_px, camera_px + surface_share * std::hypot(width, height));
  }
  return largest_px;
}

CameraDescription ShapedScene::camera(const std::vector<double>& at, std::size_t view) const {
  CameraDescription moved = original.cameras.at(views[view].camera);
  const auto pitch = moved.pixel_pitch_m();
  Vec3 turn = Vec3::Zero(), move = Vec3::Zero();
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const ShapeUnknown& u = unknowns[k];
    if (u.camera != views[view].camera) continue;
    const auto axis = static_cast<Index>(u.term);
    if (axis < 3)
      turn[axis] = at[k];
    else if (axis < 6)
      move[axis - 3] = 1e-3 * at[k];
    else if (u.term == CameraTerm::focal_length)
      moved.focal_length_m = 1e-3 * at[k];
    else if (double* coefficient = lens_term(moved, u.term))
      *coefficient = at[k];
    else {
      const std::size_t c = u.term == CameraTerm::principal_point_x ? 0 : 1;
      moved.lens.principal_point_m[c] = (at[k] - 0.5 * moved.pixels[c]) * pitch[c];
    }
  }
  move_camera(moved, turn, move);
  moved.pixels = views[view].pixels;
  return moved;
}

Scene ShapedScene::scene_at(const std::vector<double>& at) const {
  Scene moved = original;
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const ShapeUnknown& u = unknowns[k];
    for (const std::size_t s : u.surfaces)
      for (Polygon& piece : moved.surfaces[s].pieces)
        for (Vec3& v : piece)
          v += u.stretch.isZero() ? Vec3(1e-3 * at[k] * u.move)
                                  : Vec3(at[k] * u.stretch.cwiseProduct(v - u.pivot_m));
  }
  return moved;
}

void ShapedScene::move_to(const std::vector<double>& at) {
  bool surfaces_move = false;
  for (std::size_t k = 0; k < unknowns.size(); ++k)
    surfaces_move = surfaces_move || (unknowns[k].moves_surfaces() && at[k] != values[k]);
  std::vector<CameraDescription> cameras;
  for (std::size_t v = 0; v < views.size(); ++v) cameras.push_back(camera(at, v));
  if (surfaces_move) {
    auto moved = std::make_unique<Scene>(scene_at(at));
    auto moved_model = std::make_unique<SceneModel>(*moved, model->options());
    for (std::size_t v = 0; v < views.size(); ++v)
      moved_model->add_windows(cameras[v], model->windows(v));
    scene = std::move(moved);
    model = std::move(moved_model);
  } else {
    model->move_views(cameras);
  }
  values = at;
}

BandMatrix ShapedScene::light(const SceneModel& in, const std::vector<double>& at, std::size_t view,
                              const SceneState& state, const ElementLight& elements) const {
  const auto blocks = in.see(camera(at, view), view, model->windows(view).windows);
  return in.radiosity_of(blocks, state, elements, nullptr).value;
}

std::vector<ShapeTerm> ShapedScene::linearised(const SceneState& state) const {
  const auto& blocks = model->blocks();
  const Index bands = state.reflectance.cols();
  const ElementLight here = model->element_light(state);
  std::vector<BandMatrix> base;
  for (std::size_t v = 0; v < views.size(); ++v)
    base.push_back(light(*model, values, v, state, here));
  std::vector<ShapeTerm> terms;
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const ShapeUnknown& u = unknowns[k];
    if (u.hold == Hold::fixed) continue;
    const double size = size_of(k);
    const double step = size * (u.moves_surfaces() ? kSurfaceStep / kSurfaceSize : kCameraStep_px);
    std::vector<BandMatrix> difference(views.size());
    for (const double sign : {1.0, -1.0}) {
      std::vector<double> at = values;
      at[k] += sign * step;
      std::unique_ptr<Scene> moved;
      std::unique_ptr<SceneModel> other;
      if (u.moves_surfaces()) {
        moved = std::make_unique<Scene>(scene_at(at));
        other = std::make_unique<SceneModel>(*moved, model->options());
      }
      const ElementLight there = other ? other->element_light(state) : ElementLight{};
      for (std::size_t v = 0; v < views.size(); ++v) {
        if (!u.moves_surfaces() && u.camera != views[v].camera) continue;
        const BandMatrix seen = light(other ? *other : *model, at, v, state, other ? there : here);
        if (sign > 0.0)
          difference[v] = seen;
        else
          difference[v] -= seen;
      }
    }
    ShapeTerm term{.name = u.name,
                   .unit = u.unit(),
                   .hold = u.hold,
                   .at = values[k],
                   .known = u.known,
                   .standard_uncertainty = u.standard_uncertainty,
                   .low = values[k] - kReach * size,
                   .high = values[k] + kReach * size,
                   .size = size,
                   .relative = BandMatrix::Zero(static_cast<Index>(blocks.size()), bands)};
    std::vector<Index> row(views.size(), -1);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const std::size_t v = blocks[i].view;
      ++row[v];
      if (difference[v].size() == 0) continue;
      for (Index b = 0; b < bands; ++b)
        if (base[v](row[v], b) > 0.0)
          term.relative(static_cast<Index>(i), b) =
              difference[v](row[v], b) / (2.0 * step * base[v](row[v], b));
    }
    terms.push_back(std::move(term));
  }
  return terms;
}

}  // namespace truebox

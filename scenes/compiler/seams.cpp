#include "scenes/compiler/seams.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {
namespace {

using models::Mat3;
using models::Pose;
using models::Vec3;

// How far a bridge reaches into each of its two solids, and beyond its ends if the solids continue there.
constexpr double reach_m = 1e-3;
// Decimal numbers aren't exact in binary: a gap of 1 µm may be stored as slightly more.
constexpr double within_m = joined_m * (1.0 + 1e-6);

bool joins(const Object& object) {
  if (object.motion || object.layer || is_inside_out(object.shape)) return false;
  return std::holds_alternative<BoxShape>(object.shape) || std::holds_alternative<CylinderShape>(object.shape) ||
         std::holds_alternative<PlaneShape>(object.shape);
}

// Returns the axes of b in the frame of a, as a signed permutation; nullopt if the axes aren't parallel.
std::optional<Mat3> turned_alike(const BoxShape& a, const BoxShape& b) {
  const Mat3 R = a.pose_W.linear().transpose() * b.pose_W.linear();
  const Mat3 P = R.array().round();
  const double size_m = std::max(a.size_m.norm(), b.size_m.norm());
  if ((R - P).norm() * size_m > within_m || (P.transpose() * P - Mat3::Identity()).norm() > 0.0) return {};
  return P;
}

// The extent of a box in the frame of another box with parallel edges.
struct Extent {
  Vec3 low, high;
};

Extent in_frame(const Pose& frame, const BoxShape& box) {
  const Vec3 centre = frame.inverse() * box.pose_W.translation();
  const Vec3 half =
      0.5 * ((frame.linear().transpose() * box.pose_W.linear()).cwiseAbs().array().round().matrix() * box.size_m);
  return {centre - half, centre + half};
}

BoxShape as_box(const Pose& frame, const Extent& extent) {
  BoxShape box;
  box.pose_W = frame;
  box.pose_W.translation() = frame * (0.5 * (extent.low + extent.high));
  box.size_m = extent.high - extent.low;
  return box;
}

// Returns the axis along which faces of a and b are in contact while a and b overlap along the other axes; nullopt if
// there is none.
std::optional<int> shared_axis(const Extent& a, const Extent& b) {
  for (int k = 0; k < 3; ++k) {
    const bool touch = std::abs(a.high[k] - b.low[k]) <= within_m || std::abs(b.high[k] - a.low[k]) <= within_m;
    bool overlap = true;
    for (const int i : {(k + 1) % 3, (k + 2) % 3}) {
      overlap = overlap && std::min(a.high[i], b.high[i]) - std::max(a.low[i], b.low[i]) > within_m;
    }
    if (touch && overlap) return k;
  }
  return {};
}

class Joiner {
 public:
  explicit Joiner(const Scene& scene) : objects_(scene.objects) {
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      if (joins(objects_[i])) (is_plane(i) ? planes_ : solids_).push_back(i);
    }
    sort_along_x();
  }

  Joined join() {
    // A face that was moved may meet a third face, which may meet a fourth. So levelling is repeated, at most once per
    // solid.
    for (std::size_t round = 0; round < solids_.size() && level_all(); ++round) {
    }
    for_pairs([this](std::size_t i, std::size_t j) { bridge(i, j); });
    for (const std::size_t i : solids_) {
      for (const std::size_t plane : planes_) bridge_to_plane(i, plane);
    }
    return {std::move(objects_), std::move(seams_)};
  }

 private:
  [[nodiscard]] bool is_plane(std::size_t i) const { return std::holds_alternative<PlaneShape>(objects_[i].shape); }

  void sort_along_x() {
    bounds_.resize(objects_.size());
    for (const std::size_t i : solids_) {
      const double middle = middle_of(objects_[i].shape).x(), reach = size_of(objects_[i].shape) + within_m;
      bounds_[i] = {middle - reach, middle + reach};
    }
    std::sort(solids_.begin(), solids_.end(),
              [this](std::size_t a, std::size_t b) { return bounds_[a].first < bounds_[b].first; });
  }

  // Calls `visit` for all pairs of solids whose bounds overlap along x.
  template <typename Visit>
  void for_pairs(const Visit& visit) {
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      for (std::size_t n = k + 1; n < solids_.size(); ++n) {
        const std::size_t i = solids_[k], j = solids_[n];
        if (bounds_[j].first > bounds_[i].second) break;
        visit(i, j);
      }
    }
  }

  // Removes steps of less than joined_m between faces. True if there were any.
  bool level_all() {
    bool changed = false;
    for_pairs([&](std::size_t i, std::size_t j) {
      auto* const a = std::get_if<BoxShape>(&objects_[i].shape);
      auto* const b = std::get_if<BoxShape>(&objects_[j].shape);
      if (a != nullptr && b != nullptr) changed = level(*a, *b) || changed;
      auto* const c = std::get_if<CylinderShape>(&objects_[i].shape);
      auto* const d = std::get_if<CylinderShape>(&objects_[j].shape);
      if (c == nullptr || d == nullptr || !ends_on(*c, *d) || c->radius_m == d->radius_m) return;
      if (std::abs(c->radius_m - d->radius_m) > within_m) return;
      c->radius_m = d->radius_m = std::max(c->radius_m, d->radius_m);
      changed = true;
    });
    return changed;
  }

  static bool level(BoxShape& a, BoxShape& b) {
    const std::optional<Mat3> P = turned_alike(a, b);
    if (!P) return false;
    Extent of_a{-0.5 * a.size_m, 0.5 * a.size_m}, of_b = in_frame(a.pose_W, b);
    const std::optional<int> axis = shared_axis(of_a, of_b);
    if (!axis) return false;
    bool steps = (a.pose_W.linear() * *P - b.pose_W.linear()).norm() > 0.0;
    bool a_grows = false;
    // Differences below this are rounding, not steps.
    const double rounding = 1e-15 * (a.pose_W.translation().norm() + b.pose_W.translation().norm() + of_b.high.norm());
    const auto put = [&](double& one, double& other, double outer) {
      if (std::abs(one - other) > within_m || std::abs(one - other) <= rounding) return;
      a_grows = a_grows || one != outer;
      one = other = outer;
      steps = true;
    };
    for (const int i : {(*axis + 1) % 3, (*axis + 2) % 3}) {
      put(of_a.high[i], of_b.high[i], std::max(of_a.high[i], of_b.high[i]));
      put(of_a.low[i], of_b.low[i], std::min(of_a.low[i], of_b.low[i]));
    }
    if (!steps) return false;
    const Pose frame = a.pose_W;
    b = as_box(frame, of_b);
    if (a_grows) a = as_box(frame, of_a);
    return true;
  }

  // True if the cylinders are coaxial and an end of a touches an end of b.
  static bool ends_on(const CylinderShape& a, const CylinderShape& b) {
    const Vec3 e = (a.to_m - a.from_m).normalized();
    const auto off_axis_m = [&](const Vec3& x) { return (x - a.from_m - e * e.dot(x - a.from_m)).norm(); };
    if (off_axis_m(b.from_m) > within_m || off_axis_m(b.to_m) > within_m) return false;
    return upon(a.from_m, b.from_m) || upon(a.from_m, b.to_m) || upon(a.to_m, b.from_m) || upon(a.to_m, b.to_m);
  }
  static bool upon(const Vec3& x, const Vec3& y) { return (x - y).norm() <= 2.0 * within_m; }

  void bridge(std::size_t i, std::size_t j) {
    const auto* const a = std::get_if<BoxShape>(&objects_[i].shape);
    const auto* const b = std::get_if<BoxShape>(&objects_[j].shape);
    const auto* const c = std::get_if<CylinderShape>(&objects_[i].shape);
    const auto* const d = std::get_if<CylinderShape>(&objects_[j].shape);
    if (a != nullptr && b != nullptr) return bridge_boxes(i, j);
    if (a != nullptr && d != nullptr) return bridge_end(j, i);
    if (b != nullptr && c != nullptr) return bridge_end(i, j);
    if (c != nullptr && d != nullptr) c->radius_m <= d->radius_m ? bridge_end(i, j) : bridge_end(j, i);
  }

  void bridge_boxes(std::size_t i, std::size_t j) {
    const BoxShape &a = std::get<BoxShape>(objects_[i].shape), &b = std::get<BoxShape>(objects_[j].shape);
    if (!turned_alike(a, b)) return;
    const Extent of_a{-0.5 * a.size_m, 0.5 * a.size_m}, of_b = in_frame(a.pose_W, b);
    const std::optional<int> axis = shared_axis(of_a, of_b);
    if (!axis) return;
    const int k = *axis;
    Extent shared{of_a.low.cwiseMax(of_b.low), of_a.high.cwiseMin(of_b.high)};
    const double middle = 0.5 * (shared.low[k] + shared.high[k]);
    const double reach = std::min(reach_m, 0.25 * std::min(a.size_m[k], of_b.high[k] - of_b.low[k]));
    shared.low[k] = middle - reach;
    shared.high[k] = middle + reach;
    lengthen(a.pose_W, k, reach, shared);
    add(i, j, as_box(a.pose_W, shared));
  }

  // Bridges a box and the plane on which it stands.
  void bridge_box_to_plane(std::size_t i, std::size_t plane, const Vec3& n, const Vec3& point) {
    const BoxShape& box = std::get<BoxShape>(objects_[i].shape);
    const Vec3 n_box = box.pose_W.linear().transpose() * n;
    int k = 0;
    n_box.cwiseAbs().maxCoeff(&k);
    Vec3 along = Vec3::Zero();
    along[k] = n_box[k] > 0.0 ? 1.0 : -1.0;
    const double foot_m = n.dot(box.pose_W.translation() - point) - 0.5 * box.size_m[k];
    if ((n_box - along).norm() * box.size_m.norm() > within_m || std::abs(foot_m) > within_m) return;
    Extent shared{-0.5 * box.size_m, 0.5 * box.size_m};
    const double reach = std::min(reach_m, 0.25 * box.size_m[k]);
    const double foot = -along[k] * 0.5 * box.size_m[k];
    shared.low[k] = foot - reach;
    shared.high[k] = foot + reach;
    add(i, plane, as_box(box.pose_W, shared));
  }

  void bridge_to_plane(std::size_t i, std::size_t plane) {
    const PlaneShape& flat = std::get<PlaneShape>(objects_[plane].shape);
    const Vec3 n = flat.normal.normalized();
    if (std::holds_alternative<BoxShape>(objects_[i].shape)) return bridge_box_to_plane(i, plane, n, flat.point_m);
    const CylinderShape& cylinder = std::get<CylinderShape>(objects_[i].shape);
    for (const auto& [end, other] : ends(cylinder)) {
      const Vec3 out = (end - other).normalized();
      if ((out + n).norm() * cylinder.radius_m > within_m || std::abs(n.dot(end - flat.point_m)) > within_m) continue;
      add_disc(i, plane, end, out);
    }
  }

  static std::array<std::pair<Vec3, Vec3>, 2> ends(const CylinderShape& c) {
    return {std::pair{c.from_m, c.to_m}, std::pair{c.to_m, c.from_m}};
  }

  // Bridges the end of a cylinder and the face of a box, or the end of another cylinder, that contains this end.
  void bridge_end(std::size_t i, std::size_t other) {
    const CylinderShape& cylinder = std::get<CylinderShape>(objects_[i].shape);
    for (const auto& [end, far_end] : ends(cylinder)) {
      const Vec3 out = (end - far_end).normalized();
      if (lies_within(objects_[other].shape, end, out, cylinder.radius_m)) add_disc(i, other, end, out);
    }
  }

  static bool lies_within(const Shape& shape, const Vec3& end, const Vec3& out, double radius_m) {
    if (const auto* const c = std::get_if<CylinderShape>(&shape)) {
      for (const auto& [there, far_end] : ends(*c)) {
        const Vec3 facing = (there - far_end).normalized();
        if ((facing + out).norm() * radius_m > within_m || std::abs(out.dot(there - end)) > within_m) continue;
        const double beside_m = ((there - end) - out * out.dot(there - end)).norm();
        if (beside_m + radius_m <= c->radius_m + within_m) return true;
      }
      return false;
    }
    const BoxShape& box = std::get<BoxShape>(shape);
    const Vec3 x = box.pose_W.inverse() * end, n = box.pose_W.linear().transpose() * out;
    int k = 0;
    n.cwiseAbs().maxCoeff(&k);
    if ((n.cwiseAbs() - Vec3::Unit(k)).norm() * radius_m > within_m) return false;
    if (std::abs(std::abs(x[k]) - 0.5 * box.size_m[k]) > within_m || x[k] * n[k] > 0.0) return false;
    for (const int i : {(k + 1) % 3, (k + 2) % 3}) {
      if (std::abs(x[i]) + radius_m > 0.5 * box.size_m[i] + within_m) return false;
    }
    return true;
  }

  void add_disc(std::size_t i, std::size_t with, const Vec3& end, const Vec3& out) {
    CylinderShape disc = std::get<CylinderShape>(objects_[i].shape);
    const double reach = std::min(reach_m, 0.25 * (disc.to_m - disc.from_m).norm());
    disc.from_m = end - reach * out;
    disc.to_m = end + reach * out;
    add(i, with, disc);
  }

  // Extends a bridge beyond its ends where the solids continue, so that bridges that meet at a corner overlap.
  void lengthen(const Pose& frame, int across, double reach, Extent& bridge) const {
    for (const int k : {(across + 1) % 3, (across + 2) % 3}) {
      for (const bool high : {true, false}) {
        Extent more = bridge;
        (high ? more.low : more.high)[k] = high ? bridge.high[k] : bridge.low[k];
        (high ? more.high : more.low)[k] += high ? reach : -reach;
        if (solid_throughout(frame, across, more))
          (high ? bridge.high : bridge.low)[k] = (high ? more.high : more.low)[k];
      }
    }
  }

  // True if the box's corners and the points between them, moved slightly inwards, lie within solids. Along the axis
  // `across` the seam, the middle is skipped, because a gap may be there.
  [[nodiscard]] bool solid_throughout(const Pose& frame, int across, const Extent& extent) const {
    const Vec3 middle = 0.5 * (extent.low + extent.high), half = 0.5 * (extent.high - extent.low);
    for (int corner = 0; corner < 27; ++corner) {
      Vec3 x = middle;
      const std::array<int, 3> at{corner % 3 - 1, corner / 3 % 3 - 1, corner / 9 - 1};
      if (at[static_cast<std::size_t>(across)] == 0) continue;
      for (int i = 0; i < 3; ++i) x[i] += 0.999 * at[static_cast<std::size_t>(i)] * half[i];
      if (!within_a_solid(frame * x)) return false;
    }
    return true;
  }
  [[nodiscard]] bool within_a_solid(const Vec3& x_W) const {
    const auto holds = [&](std::size_t i) { return distance_to(objects_[i], x_W) <= within_m; };
    return std::any_of(planes_.begin(), planes_.end(), holds) ||
           std::any_of(solids_.begin(), solids_.end(), [&](std::size_t i) {
             return bounds_[i].first <= x_W.x() && x_W.x() <= bounds_[i].second && holds(i);
           });
  }

  void add(std::size_t i, std::size_t with, Shape shape) {
    Object bridge = objects_[i];
    bridge.shape = std::move(shape);
    seams_.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(with), std::move(bridge)});
  }

  std::vector<Object> objects_;
  std::vector<std::size_t> solids_, planes_;       // indices in objects_; solids are sorted along x
  std::vector<std::pair<double, double>> bounds_;  // bounds of each solid along x
  std::vector<Seam> seams_;
};

}  // namespace

Joined join(const Scene& scene) { return Joiner(scene).join(); }

}  // namespace proxarm::scenes

#include "models/rigid_gaps/gaps.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::models {
namespace {

// Gaps of a mesh are reduced by this, so that the tool rests this far in front of the faces. A face has no inside from
// which a tool could be brought back, so rounding must not take a touching tool through the face. Coordinates below a
// metre are rounded by 1e-16 m, and the iteration's remaining error is as small. This is a thousand times as large, and
// a tenth of kGap_m.
constexpr double kLift_m = 1e-13;

Solid::Rim rim_at(const Solid::Rim& rim, const View& at) noexcept {
  return {at * rim.centre, at.R * rim.u, at.R * rim.v, rim.radius};
}

double radius_of(const Solid* solid) noexcept { return solid != nullptr ? solid->radius : 0.0; }

}  // namespace

void Gaps::remember_lowest(Pair& pair, const View& at) const noexcept {
  Vec2 lowest = Vec2::Zero();
  if (pair.kind != PairKind::rim_field) {
    Solid::Rim rim;
    const FlatSide side = cylinders_.side_under_rim(pair, at, rim);
    lowest = lowest_of_rim(side, rim);
  } else if (const auto* flat = std::get_if<FlatSide>(&bodies_->entry(pair).object.shape)) {
    lowest = lowest_of_rim(*flat, rim_at(bodies_->part(pair).solid.rims[pair.own], at));
  }
  if (!lowest.isZero(0.0)) pair.level = {lowest.x(), lowest.y()};
}

std::optional<Touch> Gaps::touch_of(const Pair& pair, const View& at, double beside) const noexcept {
  if (pair.kind == PairKind::point_field) return in_field(pair, at);
  std::optional<Touch> touch = between_features(pair, at, beside);
  if (touch && bodies_->entry(pair).mesh() != nullptr) touch->gap -= kLift_m;
  return touch;
}

int Gaps::touches_of(const Pair& pair, const View& at, double beside, Places& out) noexcept {
  return is_of_cylinder(pair.kind) ? cylinders_.touch(pair, at, beside, out) : rim_in_field(pair, at, out);
}

Touch Gaps::in_field(const Pair& pair, const View& at) const noexcept {
  const Solid& own = bodies_->part(pair).solid;
  Touch out;
  with_flat_or_hollow(bodies_->entry(pair).object,
                      [&](const auto& shape) { out = touch(shape, at * own.points[pair.own], own.radius); });
  return out;
}

int Gaps::rim_in_field(const Pair& pair, const View& at, Places& out) const noexcept {
  const Solid::Rim rim = rim_at(bodies_->part(pair).solid.rims[pair.own], at);
  int count = 0;
  with_flat_or_hollow(bodies_->entry(pair).object, [&](const auto& shape) {
    std::array<Vec3, 4> places;
    count = nearest_of_rim(shape, rim, {pair.level[0], pair.level[1]}, places);
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) out[k] = touch(shape, places[k], 0.0);
  });
  return count;
}

std::optional<Touch> Gaps::between_features(const Pair& pair, const View& at, double beside) const noexcept {
  const Solid& own = bodies_->part(pair).solid;
  const double radii = own.radius + radius_of(bodies_->entry(pair).solid());
  switch (pair.kind) {
    case PairKind::point_face:
      return point_face(pair, at, beside);
    case PairKind::face_point:
      return face_point(pair, at, beside);
    case PairKind::edges:
      return sharp_edges(pair, at, beside);
    case PairKind::round_edges:
      return touch_edges_round(moved_edge(bodies_->own_edge(pair), at), bodies_->other_edge(pair), radii, own.radius);
    case PairKind::point_point: {
      std::optional<Touch> t = touch_point(at * own.points[pair.own], bodies_->other_point(pair), radii);
      if (t) t->point -= own.radius * t->normal;
      return t;
    }
    case PairKind::point_edge:
      return touch_round(at * own.points[pair.own], bodies_->other_edge(pair), radii, own.radius, false);
    case PairKind::edge_point:
      return touch_round(bodies_->other_point(pair), moved_edge(bodies_->own_edge(pair), at), radii, own.radius, true);
    default:
      return {};
  }
}

std::optional<Touch> Gaps::point_face(const Pair& pair, const View& at, double beside) const noexcept {
  const double side = static_cast<double>(pair.side);
  if (side == 0.0) return {};
  const Solid& own = bodies_->part(pair).solid;
  const Vec3 p = at * own.points[pair.own];
  const TriangleFeatures* mesh = bodies_->entry(pair).mesh();
  if (mesh == nullptr) {
    const Solid& solid = *bodies_->entry(pair).solid();
    const Solid::Face& face = solid.faces[pair.other];
    return touch_face(p, own.radius, face.normal, face.offset, solid.points, solid.corners(face), 1.0, beside);
  }
  const TriangleMesh::Face& face = face_of(*mesh, pair.other);
  const double height = side * TriangleMesh::height(face, p);
  if (bodies_->entry(pair).held == 0.0 && own.radius == 0.0 && height < 0.0) {
    // If the point went through this face, the face holds the point wherever the point is now. If the point came
    // around, another face holds it.
    if (!sides_->went_through(*bodies_, pair, p)) return {};
    return Touch{p, side * face.normal, height};
  }
  return touch_face(p, own.radius, face.normal, face.normal.dot(face.corner), mesh->mesh().structure().vertices,
                    mesh->mesh().triangle(pair.other), side, beside);
}

std::optional<Touch> Gaps::face_point(const Pair& pair, const View& at, double beside) const noexcept {
  if (pair.side == 0.0F) return {};
  const Solid& own = bodies_->part(pair).solid;
  const double other_radius = radius_of(bodies_->entry(pair).solid());
  const Solid::Face& face = own.faces[pair.own];
  const Vec3 y = at.R.transpose() * (bodies_->other_point(pair) - at.x);
  const std::optional<Touch> t =
      touch_face(y, other_radius, face.normal, face.offset, own.points, own.corners(face), 1.0, beside);
  if (!t) return {};
  const Vec3 foot = y - (t->gap + other_radius) * face.normal;
  return Touch{at * foot, -(at.R * face.normal), t->gap};
}

std::optional<Touch> Gaps::sharp_edges(const Pair& pair, const View& at, double beside) const noexcept {
  if (pair.side == 0.0F) return {};
  EdgeLine other = bodies_->other_edge(pair);
  const EdgeLine edge = moved_edge(bodies_->own_edge(pair), at);
  const TriangleFeatures* mesh = bodies_->entry(pair).mesh();
  if (mesh != nullptr && !other.open && !mesh->edge(pair.other).ridge) {
    other.left = -other.left;
    other.right = -other.right;
  }
  const Vec3 n = (edge.to - edge.from).cross(other.to - other.from);
  const double orientation = other.open                              ? static_cast<double>(pair.side)
                             : n.dot(other.left + other.right) < 0.0 ? -1.0
                                                                     : 1.0;
  return touch_edges_sharp(edge, other, orientation, beside);
}

// Returns the touch of a point with a face whose foot lies up to feet.over beyond a valley of the face. This is needed
// for a corner of the tool in a valley of a closed mesh:
// 1. An iterate may take the corner some nanometres behind one face of the valley. The corner's foot on the other face
//    then lies beyond the valley by as much.
// 2. When the touch with the other face wasn't found there, the tool yielded by tenths of a millimetre, until something
//    else held it.
// 3. So a pair that pressed in the last solution still counts up to as far beyond the valley as the last step of the
//    iteration went. This is correct because the plane of a face continues beyond the valley inside the body.
// 4. Next to a valley's end the body may end, too. So the iteration ends only if all feet lie on their faces.
std::optional<Touch> Gaps::over_valley(const Pair& pair, const View& at, const FootReach& feet) const noexcept {
  const RigidEntry& entry = bodies_->entry(pair);
  const RigidPart& part = bodies_->part(pair);
  const TriangleFeatures* mesh = entry.mesh();
  const bool ours = pair.kind == PairKind::face_point;
  const TriangleFeatures* features = ours ? part.mesh.get() : mesh;
  if (features == nullptr || pair.side == 0.0F) return {};
  if (!ours && (pair.kind != PairKind::point_face || entry.held == 0.0)) return {};
  const std::uint32_t index = ours ? pair.own : pair.other;
  const double side = ours ? 1.0 : static_cast<double>(pair.side);
  const std::uint8_t valleys = features->valleys_of(index, side);
  if (valleys == 0) return {};
  const double radius = ours ? radius_of(entry.solid()) : part.solid.radius;
  const Vec3 p = !ours ? at * part.solid.points[pair.own] : at.to_T(bodies_->other_point(pair));
  const Vec3& n = face_of(*features, index).normal;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& corner = features->mesh().corner(index, k);
    const Vec3 inwards = n.cross(features->mesh().corner(index, (k + 1) % 3) - corner);
    const double off = (valleys >> k & 1U) != 0 ? feet.over : beside_m;
    if (inwards.dot(p - corner) < -off * inwards.norm()) return {};
  }
  const double gap = side * TriangleMesh::height(face_of(*features, index), p) - radius,
               lift = mesh != nullptr ? kLift_m : 0.0;
  if (!ours) return Touch{p - radius * side * n, side * n, gap - lift};
  return Touch{at * Vec3(p - (gap + radius) * n), -(at.R * n), gap - lift};
}

std::optional<Touch> Gaps::touch_over(const Pair& pair, const View& at, const FootReach& feet) const noexcept {
  if (const std::optional<Touch> touch = over_valley(pair, at, feet)) return touch;
  if (pair.kind != PairKind::edges) return {};
  return touch_of(pair, at, std::max(feet.beside, feet.over));
}

bool Gaps::is_beyond_edge(const Pair& pair, double gap, const View& at) const noexcept {
  const bool of_tool = pair.kind == PairKind::face_point;
  if (!(gap < -kGap_m) || !is_point_and_face(pair.kind)) return false;
  const RigidPart& part = bodies_->part(pair);
  const Solid* solid = !of_tool ? bodies_->entry(pair).solid() : part.mesh ? nullptr : &part.solid;
  if (solid == nullptr || !(signed_height_m(*bodies_, pair, sides_->tool_at_start(*bodies_, pair)) < -kFront_m))
    return false;
  const Vec3 y = !of_tool ? at * part.solid.points[pair.own] : at.to_T(bodies_->other_point(pair));
  const Solid::Face& face = solid->faces[of_tool ? pair.own : pair.other];
  return face.normal.dot(y) - face.offset < -kGap_m && is_outside(*solid, y);
}

}  // namespace proxarm::models

#include "controller/extras/studies/stress/tool_laws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <variant>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using models::Mat6;
using models::PoseContact;
using models::ToolPose;
using models::Twist;
using models::Vec3;

// Smallest slip that must be reported; a million times the rounding of a displacement.
constexpr double kSlips_m = 1e-9;
constexpr double kShort_m = 1e-12;  // largest length by which a gap may fall short of 0
constexpr double beyond_all_m = std::numeric_limits<double>::infinity();

// Returns the least value of the distance f along a segment, by golden-section search. If the least value is at least
// `enough`, may return a lower bound of it that is at least `enough`. Precondition: f is convex, and changes by at most
// the length by which its argument moves.
template <typename Distance>
double least_along(const Vec3& a, const Vec3& b, Distance f, double enough = beyond_all_m) {
  if (a == b) return f(a);
  constexpr double share = 0.61803398874989485;
  const double length_m = (b - a).norm();
  const auto at = [&](double x) { return f(a + x * (b - a)); };
  double low = 0.0, high = 1.0, x = 1.0 - share, y = share, f_x = at(x), f_y = at(y);
  for (int k = 0; k < 70; ++k) {
    const double bound = std::min(f_x, f_y) - (high - low) * length_m;
    if (bound >= enough) return bound;
    if (f_x < f_y) {
      high = std::exchange(y, x);
      f_y = std::exchange(f_x, at(x = high - share * (high - low)));
    } else {
      low = std::exchange(x, y);
      f_x = std::exchange(f_y, at(y = low + share * (high - low)));
    }
  }
  return std::min({f_x, f_y, f(a), f(b)});
}

std::vector<Vec3> corners_of_box(const models::Pose& X, const Vec3& size) {
  std::vector<Vec3> out;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5, (i & 4) != 0 ? 0.5 : -0.5);
    out.emplace_back(X * Vec3(sign.cwiseProduct(size)));
  }
  return out;
}

double along(const std::vector<Vec3>& points, const Vec3& n, double& highest) {
  double lowest = beyond_all_m;
  highest = -beyond_all_m;
  for (const Vec3& x : points) {
    lowest = std::min(lowest, n.dot(x));
    highest = std::max(highest, n.dot(x));
  }
  return lowest;
}

// Returns the distance of p from the edge between `from` and `from` + d.
double to_edge(const Vec3& from, const Vec3& d, const Vec3& p) {
  return (p - from - std::clamp(d.dot(p - from) / d.squaredNorm(), 0.0, 1.0) * d).norm();
}

// Returns the distance of p from a triangle, by the regions of the triangle's plane. Source: Ericson, Real-Time
// Collision Detection, 5.1.5.
double to_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const Vec3 n = ab.cross(ac);
  const bool over = n.dot(ab.cross(p - a)) >= 0.0 && n.dot(bc.cross(p - b)) >= 0.0 && n.dot(ac.cross(p - a)) <= 0.0;
  if (over) return std::abs(n.normalized().dot(p - a));
  return std::min({to_edge(a, ab, p), to_edge(a, ac, p), to_edge(b, bc, p)});
}

// Returns whether a contact may be on an edge: the contact's point lies on the edge, and the contact's normal is
// perpendicular to the edge.
bool lies_on(const PoseContact& contact, const Vec3& from, const Vec3& to, double within_m) {
  const Vec3 d = to - from;
  return std::abs(contact.normal_W.dot(d)) <= within_m && to_edge(from, d, contact.point_W) <= within_m;
}

// Returns the compliance of K at a contact along a direction, m/N.
double yields(const ToolCall& call, const PoseContact& contact, const Vec3& along) {
  Twist wrench;
  wrench << along, (contact.point_W - call.r.position).cross(along);
  return wrench.dot(call.K.ldlt().solve(wrench));
}

}  // namespace

ToolLaws::ToolLaws(const scenes::Scene& scene, const models::Tool& tool) : scene_(scene) {
  for (const models::ToolPart& part : tool.parts) {
    Core& core = cores_.emplace_back();
    core.X_TP = part.X_TP;
    core.friction = part.friction;
    if (const auto* sphere = std::get_if<models::SphereTool>(&part.shape)) {
      core.corners_T = {Vec3::Zero()};
      core.radius_m = sphere->radius_m;
    } else if (const auto* capsule = std::get_if<models::CapsuleTool>(&part.shape)) {
      const Vec3 half(0.0, 0.0, 0.5 * capsule->length_m);
      core.corners_T = {-half, half};
      core.radius_m = capsule->radius_m;
    } else if (const auto* box = std::get_if<models::BoxTool>(&part.shape)) {
      core.corners_T = corners_of_box(models::Pose::Identity(), box->size_m);
      core.half_m = 0.5 * box->size_m;
      for (int k = 0; k < 3; ++k) core.normals_T.emplace_back(Vec3::Unit(k));
      core.edges_T = core.normals_T;
    } else if (const auto* hull = std::get_if<models::ConvexTool>(&part.shape)) {
      // The normals are those of all planes through three points that have all other points on one side. Each pair of
      // points counts as an edge.
      core.corners_T = hull->points_m;
      for (std::size_t i = 0; i < hull->points_m.size(); ++i) {
        for (std::size_t j = i + 1; j < hull->points_m.size(); ++j) {
          const Vec3 &a = hull->points_m[i], &b = hull->points_m[j];
          core.edges_T.emplace_back((b - a).normalized());
          for (const Vec3& c : hull->points_m) {
            const Vec3 n = (b - a).cross(c - a);
            if (n.norm() < 1e-12) continue;
            double high = 0.0;
            along(core.corners_T, n.normalized(), high);
            if (high <= n.normalized().dot(a) + 1e-12) core.normals_T.emplace_back(n.normalized());
          }
        }
      }
    }
    if (const auto* mesh = std::get_if<models::MeshTool>(&part.shape)) {
      core.corners_T = mesh->points_m;
      std::vector<Vec3> points;
      for (const Vec3& x : mesh->points_m) points.emplace_back(part.X_TP * x);
      core.mesh_T = std::make_shared<const models::TriangleMesh>(models::TriangleSoup{points, mesh->triangles});
      for (std::uint32_t f = 0; f < core.mesh_T->size(); ++f) core.pieces_T.push_back(triangle_of(*core.mesh_T, f));
    }
    for (Vec3& x : core.corners_T) x = core.X_TP * x;
    for (Vec3& n : core.normals_T) n = core.X_TP.linear() * n;
    for (Vec3& e : core.edges_T) e = core.X_TP.linear() * e;
    if (!core.normals_T.empty()) {
      core.pieces_T.push_back(piece_of(core.corners_T, core.normals_T, core.edges_T));
      core.sharp_T = sharp_edges_of(core.pieces_T.front());
    }
    if (core.mesh_T) core.sharp_T = sharp_edges_of(*core.mesh_T);
    for (const Vec3& x : core.corners_T) core.middle_T += x / static_cast<double>(core.corners_T.size());
    for (const Vec3& x : core.corners_T) core.reach_m = std::max(core.reach_m, (x - core.middle_T).norm());
  }
  for (const scenes::Object& object : scene.objects) {
    hollow_ = hollow_ || scenes::is_inside_out(object.shape);
    moves_ = moves_ || object.motion;
    double radius = beyond_all_m;
    if (const auto* sphere = std::get_if<scenes::SphereShape>(&object.shape)) radius = sphere->radius_m;
    if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&object.shape)) radius = capsule->radius_m;
    bend_per_m_.push_back(scenes::is_inside_out(object.shape) ? 0.0 : 1.0 / radius);
    std::vector<Piece>& pieces = pieces_.emplace_back();
    Edges& sharp = sharp_.emplace_back();
    if (const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape)) {
      for (std::uint32_t f = 0; f < mesh->mesh->size(); ++f) pieces.push_back(triangle_of(*mesh->mesh, f));
      sharp = sharp_edges_of(*mesh->mesh);
    } else if (const auto* box = std::get_if<scenes::BoxShape>(&object.shape)) {
      std::vector<Vec3> axes;
      for (int k = 0; k < 3; ++k) axes.emplace_back(box->pose_W.linear().col(k));
      pieces.push_back(piece_of(corners_of_box(box->pose_W, box->size_m), axes, axes));
      sharp = sharp_edges_of(pieces.back());
    }
  }
}

ToolLaws::Piece ToolLaws::piece_of(std::vector<Vec3> corners, std::vector<Vec3> normals, std::vector<Vec3> edges) {
  Piece out{std::move(corners), std::move(normals), std::move(edges)};
  for (const Vec3& x : out.corners) out.middle += x / static_cast<double>(out.corners.size());
  for (const Vec3& x : out.corners) out.reach_m = std::max(out.reach_m, (x - out.middle).norm());
  return out;
}

ToolLaws::Piece ToolLaws::triangle_of(const models::TriangleMesh& mesh, std::uint32_t face) {
  const std::vector<Vec3> corners = {mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2)};
  std::vector<Vec3> edges, normals;
  for (std::size_t k = 0; k < 3; ++k) edges.emplace_back((corners[(k + 1) % 3] - corners[k]).normalized());
  normals.emplace_back(edges[0].cross(edges[1]).normalized());
  for (const Vec3& edge : edges) normals.emplace_back(normals.front().cross(edge));
  return piece_of(corners, normals, edges);
}

// Returns a piece's sharp edges. An edge is a pair of corners that are both furthest along, or against, two of the
// normals. (A box has one normal for two opposite sides.)
ToolLaws::Edges ToolLaws::sharp_edges_of(const Piece& piece) {
  std::vector<Vec3> faces;
  const auto is_far = [&](const Vec3& x, const Vec3& n) {
    double high = 0.0;
    along(piece.corners, n, high);
    return n.dot(x) >= high - 1e-12;
  };
  for (const Vec3& normal : piece.normals) {
    for (const Vec3& n : {normal, Vec3(-normal)}) {
      const auto on =
          std::count_if(piece.corners.begin(), piece.corners.end(), [&](const Vec3& x) { return is_far(x, n); });
      const bool known = std::any_of(faces.begin(), faces.end(), [&](const Vec3& f) { return (f - n).norm() < 1e-7; });
      if (on >= 3 && !known) faces.push_back(n);
    }
  }
  Edges out;
  for (std::size_t i = 0; i < piece.corners.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vec3 &a = piece.corners[i], &b = piece.corners[j];
      const auto both =
          std::count_if(faces.begin(), faces.end(), [&](const Vec3& n) { return is_far(a, n) && is_far(b, n); });
      if (both >= 2) out.emplace_back(a, b);
    }
  }
  return out;
}

ToolLaws::Edges ToolLaws::sharp_edges_of(const models::TriangleMesh& mesh) {
  Edges out;
  for (std::uint32_t f = 0; f < mesh.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = mesh.triangle(f)[k], to = mesh.triangle(f)[(k + 1) % 3];
      // The neighbouring face has the same edge reversed.
      if (from < to) out.emplace_back(mesh.vertex(from), mesh.vertex(to));
    }
  }
  return out;
}

ToolLaws::Piece ToolLaws::moved(const Piece& piece, const ToolPose& pose) {
  Piece out = piece;
  for (Vec3& x : out.corners) x = pose * x;
  for (Vec3& n : out.normals) n = pose.orientation * n;
  for (Vec3& e : out.edges) e = pose.orientation * e;
  out.middle = pose * piece.middle;
  return out;
}

// Returns whether two balls are so far apart that the pieces inside them needn't be examined. If so, lowers `gap` to
// the balls' distance, if that is smaller.
bool ToolLaws::are_clear(const Vec3& a, double a_reach_m, const Vec3& b, double b_reach_m, double& gap) {
  const double clear = (a - b).norm() - a_reach_m - b_reach_m;
  if (!(clear > clear_m || clear >= gap)) return false;
  gap = std::min(gap, clear);
  return true;
}

// Returns the distance of two pieces, as the largest separation over all axes. If one of the axes already separates the
// pieces by `enough`, returns a lower bound instead.
double ToolLaws::between_m(const Piece& a, const Piece& b, double enough) {
  double gap = enough;
  if (are_clear(a.middle, a.reach_m, b.middle, b.reach_m, gap)) return gap;
  gap = -beyond_all_m;
  const auto suffices = [&](const Vec3& n) {
    double a_high = 0.0, b_high = 0.0;
    const double a_low = along(a.corners, n, a_high), b_low = along(b.corners, n, b_high);
    gap = std::max({gap, a_low - b_high, b_low - a_high});
    return gap >= enough;
  };
  if (std::any_of(a.normals.begin(), a.normals.end(), suffices)) return gap;
  if (std::any_of(b.normals.begin(), b.normals.end(), suffices)) return gap;
  for (const Vec3& e : a.edges) {
    for (const Vec3& f : b.edges) {
      const Vec3 across = e.cross(f);
      if (across.norm() > 1e-7 && suffices(across.normalized())) return gap;
    }
  }
  return gap;
}

// Returns the distance of a triangle from a segment with a radius (a capsule). If the balls around them or one of the
// triangle's normals separate them by `enough`, returns a lower bound instead.
double ToolLaws::from_segment_m(const Piece& triangle, const Vec3& from, const Vec3& to, double radius, double enough) {
  double gap = enough;
  if (are_clear(triangle.middle, triangle.reach_m, 0.5 * (from + to), 0.5 * (to - from).norm() + radius, gap))
    return gap;
  for (const Vec3& n : triangle.normals) {
    double high = 0.0;
    const double low = along(triangle.corners, n, high), one = n.dot(from), other = n.dot(to);
    gap = std::max(low - std::max(one, other), std::min(one, other) - high) - radius;
    if (gap >= enough) return gap;
  }
  const Vec3 &a = triangle.corners[0], &b = triangle.corners[1], &c = triangle.corners[2];
  return least_along(
             from, to, [&](const Vec3& x) { return to_triangle(a, b, c, x); }, enough + radius) -
         radius;
}

// Returns the distance between a mesh and a shape with a volume, one of which is a part of the tool and the other an
// object. For planes, corners are tested instead.
double ToolLaws::apart_from_m(const Core& core, const ToolPose& pose, std::size_t index) const {
  const scenes::Object& object = scene_.objects[index];
  const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape);
  const auto* sphere = std::get_if<scenes::SphereShape>(&object.shape);
  const auto* capsule = std::get_if<scenes::CapsuleShape>(&object.shape);
  double gap = beyond_all_m;
  // If one shape lies entirely inside the other, the depth is the size of the inner shape. All of its corners must be
  // inside: a single corner that touches the other shape from outside may lie inside by rounding (replay
  // 5924495204300528, step 31: a box whose first corner is on the tool).
  const auto all_in = [](const models::TriangleMesh& around, const std::vector<Vec3>& points, const auto& place) {
    return std::all_of(points.begin(), points.end(), [&](const Vec3& x) { return around.encloses(place(x)); });
  };
  if (mesh != nullptr && all_in(*mesh->mesh, core.corners_T, [&](const Vec3& x) { return pose * x; })) {
    return -core.reach_m - core.radius_m;
  }
  const ToolPose W_in_T{pose.orientation.conjugate() * -pose.position, pose.orientation.conjugate()};
  const auto in_T = [&](const Vec3& x) { return W_in_T * x; };
  if (core.mesh_T) {
    const auto is_in = [&](const Piece& piece) { return all_in(*core.mesh_T, piece.corners, in_T); };
    const std::vector<Piece>& pieces = pieces_[index];
    const bool inside = sphere != nullptr    ? core.mesh_T->encloses(in_T(sphere->centre_m))
                        : capsule != nullptr ? core.mesh_T->encloses(in_T(capsule->from_m))
                                             : std::all_of(pieces.begin(), pieces.end(), is_in);
    if (inside) return -core.reach_m;
  }
  const Vec3 middle = pose * core.middle_T;
  const double reach_m = core.reach_m + core.radius_m;
  const auto meet = [&](const Piece& triangle, const Vec3& from, const Vec3& to, double radius) {
    gap = std::min(gap, from_segment_m(triangle, from, to, radius, gap));
  };
  for (const Piece& other : pieces_[index]) {
    if (are_clear(other.middle, other.reach_m, middle, reach_m, gap)) continue;
    if (core.pieces_T.empty()) {
      meet(other, pose * core.corners_T.front(), pose * core.corners_T.back(), core.radius_m);
      continue;
    }
    const Piece other_T = moved(other, W_in_T);
    for (const Piece& piece : core.pieces_T) gap = std::min(gap, between_m(piece, other_T, gap));
  }
  for (const Piece& piece : core.pieces_T) {
    if (sphere != nullptr) meet(piece, in_T(sphere->centre_m), in_T(sphere->centre_m), sphere->radius_m);
    if (capsule != nullptr) meet(piece, in_T(capsule->from_m), in_T(capsule->to_m), capsule->radius_m);
  }
  return gap;
}

double ToolLaws::apart_m(const Core& core, const ToolPose& pose, const scenes::Object& object) const {
  const auto distance = [&](const Vec3& x) { return scenes::distance_to(object, x); };
  const double least = distance(pose * core.middle_T) - core.reach_m - core.radius_m;
  if (least > 0.0) return least;
  if (std::holds_alternative<scenes::PlaneShape>(object.shape) || scenes::is_inside_out(object.shape)) {
    double gap = beyond_all_m;
    for (const Vec3& x : core.corners_T) gap = std::min(gap, distance(pose * x));
    return gap - core.radius_m;
  }
  if (core.normals_T.empty()) {
    return least_along(pose * core.corners_T.front(), pose * core.corners_T.back(), distance) - core.radius_m;
  }
  const auto to_box = [&](const Vec3& x) {
    const Vec3 y = pose.orientation.conjugate() * (x - pose.position);
    const Vec3 d = (core.X_TP.inverse() * y).cwiseAbs() - core.half_m;
    return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff());
  };
  if (const auto* sphere = std::get_if<scenes::SphereShape>(&object.shape)) {
    return to_box(sphere->centre_m) - sphere->radius_m;
  }
  if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&object.shape)) {
    return least_along(capsule->from_m, capsule->to_m, to_box) - capsule->radius_m;
  }
  // The distance between two convex polyhedra is the largest separation over all their axes.
  const auto& box = std::get<scenes::BoxShape>(object.shape);
  std::vector<Vec3> corners, axes;
  for (const Vec3& x : core.corners_T) corners.emplace_back(pose * x);
  for (const Vec3& n : core.normals_T) axes.emplace_back(pose.orientation * n);
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = box.pose_W.linear().col(k);
    axes.push_back(edge);
    for (const Vec3& e : core.edges_T) {
      const Vec3 across = (pose.orientation * e).cross(edge);
      if (across.norm() > 1e-7) axes.emplace_back(across.normalized());
    }
  }
  const std::vector<Vec3> others = corners_of_box(box.pose_W, box.size_m);
  double gap = -beyond_all_m;
  for (const Vec3& n : axes) {
    double high = 0.0, other_high = 0.0;
    const double low = along(corners, n, high), other_low = along(others, n, other_high);
    gap = std::max({gap, low - other_high, other_low - high});
  }
  return gap;
}

// Computes the script's motion of a point x: c + R(ωt)(x − c) + vt + a sin(2πft + φ), with R by Rodrigues' formula.
models::Pose ToolLaws::place(std::size_t index, double time_s) const {
  models::Pose X = models::Pose::Identity();
  const std::optional<scenes::Motion>& motion = scene_.objects[index].motion;
  if (!motion) return X;
  const Vec3 axis = motion->axis.normalized();
  models::Mat3 k;
  k << 0.0, -axis.z(), axis.y(), axis.z(), 0.0, -axis.x(), -axis.y(), axis.x(), 0.0;
  const double angle = motion->turn_rad_per_s * time_s,
               phase = 2.0 * std::numbers::pi * motion->frequency_Hz * time_s + motion->phase_rad;
  X.linear() = models::Mat3::Identity() + std::sin(angle) * k + (1.0 - std::cos(angle)) * k * k;
  X.translation() = motion->centre_m - X.linear() * motion->centre_m + motion->velocity_m_per_s * time_s +
                    motion->amplitude_m * std::sin(phase);
  return X;
}

models::Pose ToolLaws::motion(std::size_t object, double since_s, double time_s) const {
  return place(object, time_s) * place(object, since_s).inverse(Eigen::Isometry);
}

void ToolLaws::carry(ToolCall& call) const {
  call.with.clear();
  for (std::size_t i = 0; moves_ && i < scene_.objects.size(); ++i) {
    const models::Pose c = motion(i, call.since_s, call.time_s);
    call.with.push_back({c * call.q.position, (models::Quaternion(c.linear()) * call.q.orientation).normalized()});
  }
}

std::vector<PoseContact> ToolLaws::carried(std::vector<PoseContact> contacts, double since_s, double time_s) const {
  if (!moves_) return contacts;
  for (PoseContact& contact : contacts) {
    const models::Pose c = motion(static_cast<std::size_t>(contact.object), since_s, time_s);
    contact.point_W = c * contact.point_W;
    contact.normal_W = c.linear() * contact.normal_W;
  }
  return contacts;
}

// With moving objects, the rounding includes that of q moved with an object, which follows from two poses of the
// object.
double ToolLaws::rounding_of_ways_m(const ToolCall& call) const {
  return (moves_ ? 3.0 : 1.0) * 8.0 * rounding_m(call.r);
}

double ToolLaws::depth_m(const ToolPose& pose_W, double time_s) const {
  double gap = beyond_all_m;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const scenes::Object& object = scene_.objects[i];
    ToolPose pose = pose_W;
    if (object.motion) {
      const models::Pose back = place(i, time_s).inverse(Eigen::Isometry);
      pose = {back * pose_W.position, (models::Quaternion(back.linear()) * pose_W.orientation).normalized()};
    }
    for (const Core& core : cores_) {
      const bool mesh = std::holds_alternative<scenes::MeshShape>(object.shape) ||
                        (core.mesh_T && !std::holds_alternative<scenes::PlaneShape>(object.shape));
      gap = std::min(gap, mesh ? apart_from_m(core, pose, i) : apart_m(core, pose, object));
    }
  }
  return -gap;
}

double ToolLaws::friction(const PoseContact& contact) const {
  const double mu = scene_.objects[static_cast<std::size_t>(contact.object)].friction;
  const std::optional<double>& own = cores_[static_cast<std::size_t>(contact.part)].friction;
  return own ? std::sqrt(*own * mu) : mu;
}

double ToolLaws::rounding_m(const ToolPose& pose) {
  return std::numeric_limits<double>::epsilon() * (pose.position.lpNorm<1>() + lever_m);
}

std::string ToolLaws::missed(const ToolCall& call) const {
  if (call.contacts.empty()) {
    const Twist off = models::difference(call.r, call.p);
    return off.head<3>().norm() + lever_m * off.tail<3>().norm() <= 8.0 * rounding_m(call.r) ? ""
                                                                                             : "a wrench of nothing";
  }
  Twist sum = Twist::Zero();
  double size = 1e-300;
  for (const PoseContact& contact : call.contacts) {
    sum.head<3>() += contact.force_W;
    sum.tail<3>() += (contact.point_W - call.r.position).cross(contact.force_W);
    size = std::max(size, contact.force_W.norm());
  }
  // If contacts press against each other, 𝒢 solves for their forces to 1e-10 of a step.
  if (!((sum - call.wrench()).norm() <= 1e-9 * size + 16.0 * call.stiffest * rounding_m(call.r))) return "balance";
  for (const PoseContact& contact : call.contacts) {
    const Vec3 &f = contact.force_W, &n = contact.normal_W;
    const double f_n = n.dot(f);
    const Vec3 f_t = f - f_n * n;
    if (!(f_n >= -1e-12 * size)) return "a pull";
    // The gap of a contact on a hollow object's wall is less exact, because the normal turns as the contact point
    // moves.
    if (std::abs(contact.gap_m) > (hollow_ ? 1e-10 : 1e-12) && f_n > 1e-9 * size) return "a force over a gap";
    const double limit = friction(contact) * f_n;
    // In hollow objects contacts may press against each other. Their forces are then exact to 1e-10 of √(eᵀK e), which
    // the contact's compliance converts to a force. With other objects 𝒢 removes any excess of a force over the
    // contact's cone.
    double beyond = 1e-11 * size;
    if (hollow_) {
      const Twist e = models::difference(call.r, call.p);
      beyond += 1e-10 * std::sqrt(e.dot(call.K * e) / yields(call, contact, n));
    }
    if (!(f_t.norm() <= limit + beyond)) return "out of the cone";
    // A contact whose slip is much smaller than the displacement that friction causes at the contact nearly sticks, so
    // the slip's direction counts less. The slip s is a difference of two places, and is exact to ε = 8 roundings:
    // those of both poses, and of points rotated with the poses (up to 5 roundings have occurred). Friction that is
    // against the exact slip s₀ = s − e, with ‖e‖ ≤ ε, deviates from friction against s by
    //   μ f_n ‖s/‖s‖ − s₀/‖s₀‖‖ ≤ 2 μ f_n ε/‖s‖
    // The same limit holds for a contact that sticks, where s₀ = 0 and ‖s‖ ≤ ε, with any direction of friction.
    const Vec3 slip = call.slip_of(contact);
    const double s = slip.norm();
    if (!(s > 0.0)) continue;
    if (s > kSlips_m && f_n > 1e-9 * size && !contact.slips) return "a slip that isn't told";
    const double least = std::max(limit * yields(call, contact, slip / s), 1e-9);
    const double off = (f_t + limit / s * slip).norm();
    const double allowed = 1e-8 * size * std::max(s, least) + 2.0 * limit * rounding_of_ways_m(call);
    if (!(off * s <= allowed)) return "not against the slip";
  }
  return {};
}

// Returns by how much a contact's normal turns in the call: the tool's own turn in rad, or the sine of the turn of two
// crossing edges' normal if that is larger.
double ToolLaws::normal_turns(const ToolCall& call, const PoseContact& contact) const {
  const ToolPose& q = call.from(contact);
  double most = models::difference(call.r, q).tail<3>().norm();
  // At each of the two poses a gap may fall short of 0 by 1e-12 m.
  const double within_m = 2e-12 + rounding_of_ways_m(call);
  const Vec3 &n = contact.normal_W, way = call.way_of(contact);
  const auto object = static_cast<std::size_t>(contact.object);
  const models::Pose X = place(object, call.time_s);
  for (const auto& [a, b] : cores_[static_cast<std::size_t>(contact.part)].sharp_T) {
    if (!lies_on(contact, call.r * a, call.r * b, within_m)) continue;
    for (const auto& [from, to] : sharp_[object]) {
      if (!lies_on(contact, X * from, X * to, within_m)) continue;
      const Vec3 along = X.linear() * (to - from);
      const Vec3 now = (call.r.orientation * (b - a)).cross(along), was = (q.orientation * (b - a)).cross(along);
      const Vec3 n0 = n.dot(now) < 0.0 ? Vec3(-was.normalized()) : Vec3(was.normalized());
      if (n0.dot(n) > 0.0 && n0.dot(way) <= within_m) most = std::max(most, n0.cross(n).norm());
    }
  }
  return most;
}

double ToolLaws::forward_m(const ToolCall& call, const PoseContact& contact) const {
  const double s = call.way_of(contact).norm();
  const double radius = cores_[static_cast<std::size_t>(contact.part)].radius_m;
  const double bend = bend_per_m_[static_cast<std::size_t>(contact.object)] + (radius > 0.0 ? 1.0 / radius : 0.0);
  return normal_turns(call, contact) * s + 0.5 * bend * s * s;
}

double ToolLaws::curvature_J(const ToolCall& call) const {
  const double turned = models::difference(call.r, call.q).tail<3>().norm();
  double sum = 0.0;
  for (const PoseContact& contact : call.contacts) {
    const double lever = (contact.point_W - call.r.position).norm();
    sum += contact.force_W.norm() * (0.5 * turned * turned * lever + forward_m(call, contact));
  }
  return sum;
}

double ToolLaws::slack_m(const ToolCall& call, double short_m) const {
  const Twist step = models::difference(call.p, call.q);
  const double step_m = std::hypot(step.head<3>().norm(), lever_m * step.tail<3>().norm());
  return std::max(short_m, 0.0) + rounding_of_ways_m(call) + 1e-10 * step_m;
}

double ToolLaws::short_m(double depth_m, const std::vector<PoseContact>& contacts) {
  for (const PoseContact& contact : contacts) depth_m = std::max(depth_m, -contact.gap_m);
  return std::clamp(depth_m, 0.0, kShort_m);
}

double ToolLaws::left_J(const ToolCall& call, double rise_J, double short_m) const {
  double forces_N = 0.0;
  for (const PoseContact& contact : call.contacts) {
    forces_N += contact.force_W.norm();
    const Vec3 y = call.on_tool(contact);
    rise_J -= contact.force_W.dot(call.from(contact) * y - call.q * y);  // minus the object's own work
  }
  return rise_J - curvature_J(call) - forces_N * slack_m(call, short_m) - 1e-12;
}

double ToolLaws::pushed_J(const ToolCall& call, double short_m) const {
  const double slack = slack_m(call, short_m);
  double sum = 0.0;
  for (const PoseContact& contact : call.contacts) {
    const double beyond_m = contact.normal_W.dot(call.way_of(contact)) - forward_m(call, contact);
    sum += std::max(contact.normal_W.dot(contact.force_W) * (beyond_m - slack), 0.0);
  }
  return sum;
}

double ToolLaws::edges_J(const ToolCall& call, const std::vector<PoseContact>& earlier) const {
  double sum = 0.0;
  for (const PoseContact& contact : call.contacts) {
    const Vec3 way = call.way_of(contact);
    const double s = way.norm(), bent_m = forward_m(call, contact) + 1e-12;
    const auto cosine_of = [&](const PoseContact& was) { return was.normal_W.dot(contact.normal_W); };
    const auto met = [&](const PoseContact& was) {
      return was.object == contact.object && was.normal_W.dot(way) <= bent_m && cosine_of(was) > 0.0;
    };
    // A normal turns locally. So of the earlier contacts with this object only those are used that are so near that the
    // contact point may have come from there. If there are none, all earlier contacts with the object are used. (Replay
    // 2305703389568219, step 172: one edge of the tool moves from a mesh's face to an edge of the next face, while
    // other edges of the tool already lie elsewhere on that next face.)
    const auto came = [&](const PoseContact& was) {
      return met(was) && (was.point_W - contact.point_W).norm() <= 2.0 * s;
    };
    const bool near = std::any_of(earlier.begin(), earlier.end(), came);
    const PoseContact* from = nullptr;
    for (const PoseContact& was : earlier) {
      if (near ? !came(was) : !met(was)) continue;
      if (from == nullptr || cosine_of(was) > cosine_of(*from)) from = &was;
    }
    if (from == nullptr) continue;
    const double sine = contact.normal_W.cross(from->normal_W).norm();
    if (sine > 1e-9) sum += contact.force_W.norm() * s * sine;
  }
  return sum;
}

}  // namespace proxarm::studies

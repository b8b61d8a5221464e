// A triangle mesh as an obstacle of a World. A MeshObstacle remembers where the proxy was, so each proxy needs a
// separate MeshObstacle. MeshObstacles may share a TriangleMesh.
//
// If several faces hold the proxy, the World sees the face that presses most. If a solution with other objects would
// lead through another face of the mesh, that face becomes a candidate too (World::fits).
#pragma once

#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "models/mesh/mesh_surface.hpp"
#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

class MeshObstacle final : public Obstacle {
 public:
  // `of_face`: the friction of each face; empty: `friction` everywhere. Throws std::invalid_argument if a friction
  // isn't finite or is negative.
  MeshObstacle(std::shared_ptr<const TriangleMesh> mesh, double friction, std::vector<double> of_face = {})
      : surface_(std::move(mesh), friction, std::move(of_face)) {}

  // Step::feature is the face's index, or its complement (~) if the proxy touches the back of the face.
  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override {
    Step out;
    const std::uint64_t unresolved = surface_.unresolved_steps();
    out.r = surface_(K, p, q);
    out.resolved = surface_.unresolved_steps() == unresolved;
    out.normal = Vec3::UnitZ();
    out.touches = out.r != p;
    const Contact<3>* most = nullptr;
    for (const Contact<3>& contact : surface_.contacts()) {
      if (most == nullptr || contact.normal.dot(out.r - p) > most->normal.dot(out.r - p)) most = &contact;
    }
    if (most == nullptr) return out;
    out.touches = true;
    out.slips = most->slips;
    out.normal = most->normal;
    out.feature = feature_of(*most);
    return out;
  }

  [[nodiscard]] std::size_t contacts(double K, const Vec3& p, const Vec3& q, const Step& s,
                                     std::array<Contact<3>, 3>& out) const noexcept override {
    static_cast<void>(surface_(K, p, q));
    if (surface_.contacts().empty()) return Obstacle::contacts(K, p, q, s, out);
    std::size_t count = 0;
    for (const Contact<3>& contact : surface_.contacts()) {
      out[count++] = {0, feature_of(contact), contact.slips, contact.normal, contact.reached};
    }
    return count;
  }

  // A proxy may end at r if a step from q to p = r ends at r. It may also end within a few lifts of that step's end,
  // because the tangent planes of adjacent faces differ by as much. But it may never end behind a face, and this is
  // tested exactly.
  [[nodiscard]] bool excludes(const Vec3& q, const Vec3& r) const noexcept override {
    const Vec3 reached = surface_(1.0, r, q);
    if (reached == r) return false;
    return !((reached - r).norm() <= 8.0 * surface_.lift_m()) || mesh().first_hit(reached, r).any();
  }

  [[nodiscard]] Tangent tangent(const Vec3& /*r*/, std::int32_t feature) const noexcept override {
    const auto index = static_cast<std::uint32_t>(feature < 0 ? ~feature : feature);
    const TriangleMesh::Face& face = mesh().face(index);
    const Vec3 n = feature < 0 ? Vec3(-face.normal) : face.normal;
    return {FlatSurface<3>::of_unit(face.corner + surface_.lift_m() * n, n), surface_.friction(index)};
  }

  // Never negative, because both sides of a mesh hold a proxy.
  [[nodiscard]] double distance(const Vec3& x) const noexcept override {
    return mesh().distance(x, std::numeric_limits<double>::infinity(), near_);
  }
  [[nodiscard]] bool comes_within(const Vec3& x, double reach) const noexcept override {
    const double most = reach + 8.0 * surface_.lift_m();
    return mesh().distance(x, most, near_) < most;
  }
  [[nodiscard]] bool bars(const Vec3& x, const Vec3& y) const noexcept override {
    Vec3 normal;
    return surface_.parts(x, y, normal);
  }
  bool parts(const Vec3& x, const Vec3& y, Vec3& normal) const noexcept override {
    return surface_.parts(x, y, normal);
  }
  // Sets the lift of a mesh that moves. Derivation, where the pose has a translation t with ‖t‖₁ ≤ size, and S is as in
  // TriangleMesh::lift_m:
  // 1. A touched point x has ‖x‖₁ ≤ √3 S + size in W.
  // 2. Transforming x to W and back rounds it by 8 u (‖x‖₁ + ‖t‖₁), and by 10 u √3 S because a rotation is orthonormal
  //    only within rounding.
  // 3. World does this twice, which rounds x by less than 64 u (S + size) in all.
  // 4. The lift gets twice this amount, 128 u (S + size), so that computed heights also stay off the faces. This is
  //    added to TriangleMesh::lift_m() = 64 u S.
  void set_rounding_size(double size_m) noexcept override {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    surface_.set_lift(3.0 * mesh().lift_m() + 128.0 * u * size_m);
  }
  void set_friction(double friction) noexcept override { surface_.set_friction(friction); }
  [[nodiscard]] Bounds bounds() const noexcept override { return mesh().bounds(); }

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return surface_.mesh(); }

 private:
  [[nodiscard]] std::int32_t feature_of(const Contact<3>& contact) const noexcept {
    const bool front = mesh().face(static_cast<std::uint32_t>(contact.feature)).normal.dot(contact.normal) > 0.0;
    return front ? contact.feature : ~contact.feature;
  }

  mutable MeshSurface surface_;  // remembers data for speed; its results don't depend on this data
  mutable std::uint32_t near_ = 0;
};

}  // namespace proxarm::models

// 𝒢 of a triangle mesh with friction, for a proxy that is a point.
//
// The proxy goes from q along straight pieces that touch no triangle, so it can't pass the surface, however it is made:
// each piece is tested exactly (mesh_predicates.hpp) against all faces that could be near. Where the pieces go:
//   1. towards p. If nothing is in the way, that is the step.
//   2. Else, from where the way is blocked, towards what holds the proxy: of the faces that it touches there,
//        one face     (4), with q projected onto the face's plane; also when the step has crossed an edge, as (17) says
//                     with v = (q(k) − q(k−1))/T
//        two faces    solve_groove, in a groove as on a convex edge
//        three faces  solve_corner
//      whichever is complete (nothing pulls, nothing else is in the way), fewest contacts first, then nearest to p.
//   3. Where that leads past a face's side it goes on from there with the faces around; where it runs into another
//      face that one joins in.
// If no set of faces is complete the proxy is held where it is (a vertex can do that).
//
// Faces that touch are known by exact sides and by heights within the lift (TriangleMesh::lift_m): the surface that the
// proxy glides on is that much in front of the triangles, 2e-14 m for a mesh within one metre, which is units in the
// last place. A proxy that is on it and sticks is returned bit for bit. K does not appear. What was asked before speeds
// up the next step and does not change it.
//
// Both sides of a face hold: a body is solid for a proxy outside, and a cavity for one inside.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "models/geometric_algorithm.hpp"
#include "models/mesh.hpp"

namespace proxarm::models {

class MeshSurface final : public GeometricAlgorithm<3> {
 public:
  // A mesh may serve several surfaces. `of_face`: friction by face, where it isn't the same everywhere; empty, or as
  // many as the mesh has faces. Throws std::invalid_argument for a friction that isn't finite and ≥ 0.
  MeshSurface(std::shared_ptr<const TriangleMesh> mesh, double friction, std::vector<double> of_face = {});

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  // Contact::feature is the face's index in the mesh; its normal is on the proxy's side.
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  // Steps in which no set of faces was complete: the proxy stayed where it was held.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return *mesh_; }
  [[nodiscard]] double friction(std::uint32_t face) const noexcept {
    return friction_of_face_.empty() ? mu_ : friction_of_face_[face];
  }
  // From the next step on, where it isn't by face; finite and not negative.
  void set_friction(double friction) noexcept { mu_ = friction; }

  // How far the surface that is touched is in front of the faces: TriangleMesh::lift_m(), or more where q and p come
  // with more rounding than the mesh's own coordinates explain. A proxy on the former surface is brought to the new one
  // by its next step, as long as they differ by a factor of two at most.
  [[nodiscard]] double lift_m() const noexcept { return lift_; }
  void set_lift(double lift_m) noexcept;

  // Exactly: whether a face has a point in common with the segment; if so, the normal of the first such, towards x.
  bool parts(const Vec3& x, const Vec3& y, Vec3& normal) noexcept;

 private:
  struct Walk;  // one step on its way

  [[nodiscard]] bool is_clear(const Vec3& p, const Vec3& q) const noexcept;
  void find_clearance(const Vec3& q) noexcept;
  [[nodiscard]] bool has_near(const Vec3& x) const noexcept;
  void come_near(const Vec3& x, const Vec3& move) noexcept;
  [[nodiscard]] TriangleMesh::Hit first_hit(const Vec3& x, const Vec3& y) noexcept;
  void keep_side(const Contact<3>& contact) noexcept;
  [[nodiscard]] bool glides(const Vec3& p, const Vec3& q, Vec3& r) noexcept;

  std::shared_ptr<const TriangleMesh> mesh_;
  double mu_;
  std::vector<double> friction_of_face_;
  double lift_;
  std::array<Contact<3>, 3> contacts_{};
  std::size_t count_ = 0;
  std::uint64_t unresolved_ = 0;

  // All faces that come within near_radius_ of near_centre_: asked for again when a way leaves that ball. By columns,
  // because each step looks at all of them.
  static constexpr std::size_t kNear = 96, kTogether = 4;
  struct Near {
    using Column = Eigen::Array<double, kNear, 1>;
    Column x, y, z, offset;  // of normals; zeros where a normal can't be trusted
    std::array<std::uint32_t, kNear> face;
    std::size_t count = 0;

    void add(std::uint32_t index, const TriangleMesh::Face& face) noexcept;
    // Fills up to a multiple of kTogether with planes that nothing is close to.
    void finish() noexcept;
  };
  // Calls visit(face) for each near face whose plane is not proven to have both points on one side, farther away than
  // `margin` and what rounding explains.
  template <typename Visit>
  void maybe_between(const Vec3& x, const Vec3& y, double margin, Visit visit) const noexcept;

  Near near_;
  Vec3 near_centre_ = Vec3::Zero();
  double near_radius_ = -1.0;
  Vec3 last_move_ = Vec3::Zero();

  // The face that held the proxy alone in the last step with contact, and from which side.
  struct Held {
    std::uint32_t face = 0;
    int side = 0;  // 0: there is none
    FlatSurface<3> surface = FlatSurface<3>::of_unit(Vec3::Zero(), Vec3::UnitZ());
    std::array<Vec3, 3> out;    // of its sides: unit, in its plane
    std::array<double, 3> rim;  // outᵀ corner
  };
  Held held_;

  // No face is closer than clearance_ to clear_at_.
  Vec3 clear_at_ = Vec3::Zero();
  double clearance_ = -1.0;
  std::uint32_t nearest_face_ = 0;
};

}  // namespace proxarm::models

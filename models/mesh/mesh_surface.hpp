// 𝒢 of a triangle mesh with friction, for a proxy that is a point.
//
// The proxy goes from q along straight pieces that touch no triangle. Each piece is tested exactly
// (mesh_predicates.hpp) against all faces that could be near, so the proxy can't pass the surface, however irregular
// the mesh is. The pieces lead:
//   1. towards p. If nothing is in the way, the step ends there.
//   2. Otherwise, from where the way is blocked, towards the point at which the faces that the proxy touches hold it:
//        one face     (4), with q projected onto the face's plane even if q lies over another face: v in (17) is that
//                     of the whole step, (q(k) − q(k−1))/T
//        two faces    solve_groove, in a groove as on a convex edge
//        three faces  solve_corner
//      The first set that is complete counts (contact_search.hpp): nothing pulls and nothing else is in the way; fewer
//      faces come first, then the point nearest to p.
//   3. Where a piece leads over an edge of its face, the walk goes on from there with the faces around. Where it meets
//      another face, that face joins the touched ones.
// If no set of faces is complete, the proxy is held where it is (a vertex can do that).
//
// The surface on which the proxy glides is a little in front of the triangles: by the lift (TriangleMesh::lift_m),
// 2e-14 m for a mesh within one metre, which is some units in the last place. Whether a face is touched is told by
// exact sides and by heights within a few lifts. A proxy that is on this surface and sticks is returned bit for bit. K
// does not appear. What is remembered from earlier steps makes a step faster; it doesn't change the result.
//
// Both sides of a face hold: a body is solid for a proxy outside, and a cavity for a proxy inside.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/mesh/mesh.hpp"

namespace proxarm::models {

class MeshSurface final : public GeometricAlgorithm<3> {
 public:
  // Several surfaces may share a mesh. `of_face` is the friction of each face; empty if it is the same everywhere.
  // Throws std::invalid_argument for a friction that isn't finite and ≥ 0, and for another number of them than of
  // faces.
  MeshSurface(std::shared_ptr<const TriangleMesh> mesh, double friction, std::vector<double> of_face = {});

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  // Contact::feature is the face's index in the mesh; its normal is on the proxy's side.
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  // Steps so far in which no set of faces was complete: the proxy stayed where it had got to.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return *mesh_; }
  [[nodiscard]] double friction(std::uint32_t face) const noexcept {
    return friction_of_face_.empty() ? mu_ : friction_of_face_[face];
  }
  // Takes effect from the next step on, unless friction is by face. Precondition: finite and not negative.
  void set_friction(double friction) noexcept { mu_ = friction; }

  // How far the touched surface is in front of the faces: TriangleMesh::lift_m(), or more where q and p carry more
  // rounding than the mesh's own coordinates do (a moving mesh). After a change the next step brings a proxy from the
  // old surface to the new one. Precondition of set_lift(): at least TriangleMesh::lift_m(), and at most twice or half
  // of the lift before while a proxy is in contact.
  [[nodiscard]] double lift_m() const noexcept { return lift_; }
  void set_lift(double lift_m) noexcept;

  // Whether a face has a point in common with the segment, exactly. If so, `normal` becomes that of the first such
  // face, towards x.
  bool parts(const Vec3& x, const Vec3& y, Vec3& normal) noexcept;

 private:
  struct Walk;  // one step on its way from q (mesh_walk.hpp)

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

  // All faces that come within near_radius_ of near_centre_. They are gathered again when a way leaves that ball. Each
  // step looks at all of them, so they are stored by columns for vector instructions. Where more than kNear faces are
  // that near, the tree is asked at each step instead, which is slower.
  static constexpr std::size_t kNear = 96, kTogether = 4;
  struct Near {
    using Column = Eigen::Array<double, kNear, 1>;
    Column x, y, z, offset;  // of normals; zeros where a normal can't be trusted
    std::array<std::uint32_t, kNear> face;
    std::size_t count = 0;

    void add(std::uint32_t index, const TriangleMesh::Face& face) noexcept;
    // Pads the columns to a multiple of kTogether with planes that nothing is close to.
    void finish() noexcept;
  };
  // Calls visit(face) for each near face, except those whose plane provably has both points on one side, farther away
  // than `margin` and rounding.
  template <typename Visit>
  void maybe_between(const Vec3& x, const Vec3& y, double margin, Visit visit) const noexcept;

  Near near_;
  Vec3 near_centre_ = Vec3::Zero();
  double near_radius_ = -1.0;
  Vec3 last_move_ = Vec3::Zero();

  // The face that last held the proxy alone, and from which side.
  struct Held {
    std::uint32_t face = 0;
    int side = 0;  // 0: there is none
    FlatSurface<3> surface = FlatSurface<3>::of_unit(Vec3::Zero(), Vec3::UnitZ());
    std::array<Vec3, 3> out;    // of each side: the outward normal in the face's plane, unit
    std::array<double, 3> rim;  // outᵀ corner
  };
  Held held_;

  // No face is closer than clearance_ to clear_at_.
  Vec3 clear_at_ = Vec3::Zero();
  double clearance_ = -1.0;
  std::uint32_t nearest_face_ = 0;
};

}  // namespace proxarm::models

// The 𝒢 of a triangle mesh with friction, for a proxy that is a point.
//
// The proxy moves from q along straight pieces that touch no triangle. Each piece is tested exactly
// (mesh_predicates.hpp) against all near faces, so the proxy can't pass the surface, however irregular the mesh is. The
// pieces lead
//   1. towards p. If this path is free, the step ends at p.
//   2. otherwise, from the place where the path is blocked, to the point at which the touched faces hold the proxy:
//        one face     (4), with q projected onto the face's plane even if q is over another face. So v in (17) is that
//                     of the whole step, (q(k) − q(k−1))/T
//        two faces    solve_groove, in a groove and on a convex edge
//        three faces  solve_corner
//      The first complete set of faces is taken (contact_search.hpp). Smaller sets come first; among sets of one size,
//      the set whose point is nearest to p comes first.
//   3. over an edge of the face: the walk continues with the faces around the edge. If a piece meets another face, this
//      face is added to the touched faces.
// If no set of faces is complete, the proxy stays where it is (a vertex can hold it there).
//
// The surface on which the proxy glides is in front of the triangles by the lift (TriangleMesh::lift_m), 2e-14 m for a
// mesh within one metre. A face counts as touched by its exact side and by a height within a few lifts. A proxy that is
// on the lifted surface and sticks is returned bit for bit. K doesn't appear. Data from earlier steps makes a step
// faster but doesn't change its result.
//
// Both sides of a face hold the proxy: a body is solid for a proxy outside, and a cavity for a proxy inside.
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
  // `of_face`: the friction of each face; empty: `friction` everywhere. Several MeshSurfaces may share a mesh. Throws
  // std::invalid_argument if a friction isn't finite or is negative, or if the size of `of_face` differs from the
  // mesh's size.
  MeshSurface(std::shared_ptr<const TriangleMesh> mesh, double friction, std::vector<double> of_face = {});

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  // Contact::feature is the face's index in the mesh. Contact::normal points to the side of the proxy.
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  // Returns the number of steps so far in which no set of faces was complete, so that the proxy stayed where it was.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return *mesh_; }
  [[nodiscard]] double friction(std::uint32_t face) const noexcept {
    return friction_of_face_.empty() ? mu_ : friction_of_face_[face];
  }
  // Sets the friction from the next step on, unless each face has its own friction. Precondition: `friction` is finite
  // and not negative.
  void set_friction(double friction) noexcept { mu_ = friction; }

  // The lift (m): how far the touched surface is in front of the faces. It is TriangleMesh::lift_m(), or more if q and
  // p have larger rounding errors than the mesh's coordinates (for a moving mesh). After a change, the next step takes
  // the proxy to the new surface. Preconditions of set_lift(): `lift_m` is at least TriangleMesh::lift_m(); while a
  // proxy is in contact, it is between half of and twice the last lift.
  [[nodiscard]] double lift_m() const noexcept { return lift_; }
  void set_lift(double lift_m) noexcept;

  // Whether a face has a point in common with the segment from x to y; exact. If so, `normal` becomes the normal of the
  // first such face, on the side of x.
  bool parts(const Vec3& x, const Vec3& y, Vec3& normal) noexcept;

 private:
  struct Walk;  // one step on its path from q (mesh_walk.hpp)

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

  // All faces within near_radius_ of near_centre_. They are gathered again when a path leaves that ball. Each step
  // tests all of these faces, so they are stored by columns for vector instructions. If more than kNear faces are in
  // the ball, each step searches the tree instead, which is slower.
  static constexpr std::size_t kNear = 96, kTogether = 4;
  struct Near {
    using Column = Eigen::Array<double, kNear, 1>;
    Column x, y, z, offset;  // normals and offsets; zeros if a face's normal can't be trusted
    std::array<std::uint32_t, kNear> face;
    std::size_t count = 0;

    void add(std::uint32_t index, const TriangleMesh::Face& face) noexcept;
    // Fills the columns up to a multiple of kTogether with planes far away from everything.
    void finish() noexcept;
  };
  // Calls visit(face) for each near face, except faces that are provably not between x and y: both points are on one
  // side of the face's plane, and farther from it than `margin` and rounding.
  template <typename Visit>
  void maybe_between(const Vec3& x, const Vec3& y, double margin, Visit visit) const noexcept;

  Near near_;
  Vec3 near_centre_ = Vec3::Zero();
  double near_radius_ = -1.0;
  Vec3 last_move_ = Vec3::Zero();

  // The face that last held the proxy alone, and the side of the face on which the proxy was.
  struct Held {
    std::uint32_t face = 0;
    int side = 0;  // 1: front, −1: back, 0: no face
    FlatSurface<3> surface = FlatSurface<3>::of_unit(Vec3::Zero(), Vec3::UnitZ());
    std::array<Vec3, 3> out;  // for each side of the triangle: the unit vector in its plane that is normal to the side
                              // and points outwards
    std::array<double, 3> rim;  // for each side of the triangle: outᵀ corner, for a corner on this side
  };
  Held held_;

  // No face is closer than clearance_ (m) to clear_at_.
  Vec3 clear_at_ = Vec3::Zero();
  double clearance_ = -1.0;
  std::uint32_t nearest_face_ = 0;
};

}  // namespace proxarm::models

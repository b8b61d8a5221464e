// 𝒢 of a triangle mesh with friction, for a proxy that is a point.
//
// The proxy moves from q along straight pieces that touch no triangle. Each piece is tested exactly
// (mesh_predicates.hpp) against all near faces, so the proxy can't pass the surface, however irregular the mesh is. The
// pieces lead:
//   1. towards p. If this way is free, the step ends at p.
//   2. otherwise, from the place where the way is blocked, towards the point at which the touched faces hold the proxy:
//        one face     (4), with q projected onto the face's plane even if q is over another face: v in (17) is the
//                     whole step's, (q(k) − q(k−1))/T
//        two faces    solve_groove, in a groove and on a convex edge
//        three faces  solve_corner
//      The first complete set counts (contact_search.hpp). Fewer faces come first, then the point nearest to p.
//   3. over an edge of the face: the walk continues with the faces around. If a piece meets another face, that face
//      joins the touched ones.
// If no set of faces is complete, the proxy is held where it is (a vertex can do that).
//
// The surface on which the proxy glides is in front of the triangles by the lift (TriangleMesh::lift_m): 2e-14 m for a
// mesh within one metre. Exact sides and heights within a few lifts decide whether a face is touched. A proxy that is
// on this surface and sticks is returned bit for bit. K does not appear. Data kept from earlier steps makes a step
// faster and doesn't change its result.
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
  // Several surfaces may share a mesh. `of_face` is the friction of each face; empty: `friction` everywhere. Throws
  // std::invalid_argument for a friction that isn't finite and ≥ 0, and if `of_face` has another size than the mesh.
  MeshSurface(std::shared_ptr<const TriangleMesh> mesh, double friction, std::vector<double> of_face = {});

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  // Contact::feature is the face's index in the mesh; the normal points to the proxy's side.
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  // Steps so far in which no set of faces was complete, and the proxy stayed at the place it had reached.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return *mesh_; }
  [[nodiscard]] double friction(std::uint32_t face) const noexcept {
    return friction_of_face_.empty() ? mu_ : friction_of_face_[face];
  }
  // Takes effect with the next step, unless friction is by face. Precondition: finite and not negative.
  void set_friction(double friction) noexcept { mu_ = friction; }

  // How far the touched surface is in front of the faces, m: TriangleMesh::lift_m(), or more if q and p carry more
  // rounding than the mesh's coordinates (a moving mesh). After a change, the next step takes the proxy to the new
  // surface. Precondition of set_lift(): at least TriangleMesh::lift_m(); while a proxy is in contact, between half and
  // twice the last lift.
  [[nodiscard]] double lift_m() const noexcept { return lift_; }
  void set_lift(double lift_m) noexcept;

  // Whether a face has a point in common with the segment, exactly. If so, `normal` becomes the first such face's
  // normal, towards x.
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

  // All faces within near_radius_ of near_centre_, gathered anew when a way leaves that ball. Each step tests all of
  // them, so they are stored by columns for vector instructions. If more than kNear faces are that near, each step asks
  // the tree instead, which is slower.
  static constexpr std::size_t kNear = 96, kTogether = 4;
  struct Near {
    using Column = Eigen::Array<double, kNear, 1>;
    Column x, y, z, offset;  // of normals; zeros if a normal can't be trusted
    std::array<std::uint32_t, kNear> face;
    std::size_t count = 0;

    void add(std::uint32_t index, const TriangleMesh::Face& face) noexcept;
    // Pads the columns to a multiple of kTogether with planes far away from everything.
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

  // The face that last held the proxy alone, and its side.
  struct Held {
    std::uint32_t face = 0;
    int side = 0;  // 1: front, −1: back, 0: no face
    FlatSurface<3> surface = FlatSurface<3>::of_unit(Vec3::Zero(), Vec3::UnitZ());
    std::array<Vec3, 3> out;    // for each side of the triangle: the outward normal in the face's plane, unit
    std::array<double, 3> rim;  // outᵀ corner
  };
  Held held_;

  // No face is closer than clearance_ to clear_at_.
  Vec3 clear_at_ = Vec3::Zero();
  double clearance_ = -1.0;
  std::uint32_t nearest_face_ = 0;
};

}  // namespace proxarm::models

// A surface of triangles with a bounding-volume tree. It finds the faces near a point, the first face that a path hits,
// and the distance to the nearest face. A mesh is built once in double precision and is then constant. Queries don't
// allocate and may come from any thread.
//
// Seen from the front of a face, the face's corners run counter-clockwise; the fronts of a body are outside. Nothing
// passes a face in either direction, so a mesh may be open, closed or a set of unconnected triangles.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <vector>

#include "models/obstacles/obstacle.hpp"
#include "models/surfaces/flat_surface.hpp"

namespace proxarm::models {

// Indexed triangles as mesh files contain them. Coordinates are in metres, in the proxy's frame.
struct TriangleSoup {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// The number of defects of one kind, and the place of the first of them.
struct MeshDefect {
  std::size_t count = 0;
  Vec3 first_W = Vec3::Zero();
};

class TriangleMesh {
 public:
  // The data of a face that most queries need, in one cache line.
  struct alignas(64) Face {
    Vec3 corner;  // first vertex
    Vec3 normal;  // unit within 2u, out of the front
    // Factor for doubt(): 1, or infinite for a triangle so thin that its normal isn't known within 2u.
    double trust = 1.0;
    double offset;  // normalᵀ corner, rounded; only for first tests
  };

  // A point with its coordinates rounded up and down to float, so that distances from the point are rounded down.
  struct Around {
    std::array<Eigen::Array4f, 3> x;  // {up, up, −down, −down}
    explicit Around(const Vec3& point) noexcept;
  };
  // Two nodes of the tree, in one cache line. The nodes' boxes are rounded outwards.
  struct alignas(64) NodePair {
    std::array<Eigen::Array4f, 3> box;     // for each axis: the lows of both boxes, then −1 times their highs
    std::array<std::uint32_t, 2> first{};  // the node's first face or, for an inner node, its pair of child nodes
    std::array<std::uint32_t, 2> count{};  // number of faces; 0: an inner node
    [[nodiscard]] double low(std::size_t k, Eigen::Index axis) const noexcept {
      return box[static_cast<std::size_t>(axis)][static_cast<Eigen::Index>(k)];
    }
    [[nodiscard]] double high(std::size_t k, Eigen::Index axis) const noexcept {
      return -box[static_cast<std::size_t>(axis)][static_cast<Eigen::Index>(k + 2)];
    }
    // Returns the squared distances of a point from both boxes. They are never too large, and too small by at most a
    // millionth and the rounding of x to float.
    [[nodiscard, gnu::always_inline]] inline std::array<double, 2> distance2(const Around& point) const noexcept {
      Eigen::Array4f sum = Eigen::Array4f::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Eigen::Array4f out = (box[axis] - point.x[axis]).max(0.0f);
        sum += out * out;  // low and high can't both contribute
      }
      sum *= 1.0f - 1e-6f;
      return {sum[0] + sum[2], sum[1] + sum[3]};
    }
  };
  // The parts of a mesh that take long to build. A mesh restored from them equals the original mesh to the bit.
  struct Structure {
    std::vector<Vec3> vertices;                           // only vertices that triangles use
    std::vector<std::array<std::uint32_t, 3>> triangles;  // in the tree's order
    std::vector<NodePair> nodes;                          // begins with the root, which is alone in its pair
    std::uint64_t dropped = 0;                            // triangles left out because they have no area
    bool closed = false;
  };

  // Builds a mesh: merges vertices with the same coordinates, leaves out triangles without area, and sorts the
  // triangles so that neighbours in space are neighbours in memory. Triangles without area have no sides, and in a mesh
  // without gaps their neighbours cover them. Throws std::invalid_argument if no triangle is left, an index is out of
  // range, or a coordinate isn't finite or is beyond 1e9 m.
  explicit TriangleMesh(TriangleSoup soup);

  // Restores a mesh from the structure() of another mesh. Throws std::invalid_argument if an index in the structure is
  // out of bounds. Precondition: the boxes contain their triangles (a cache's signature guarantees this).
  static TriangleMesh restored(Structure structure);
  [[nodiscard]] const Structure& structure() const noexcept { return structure_; }

  [[nodiscard]] std::size_t size() const noexcept { return structure_.triangles.size(); }
  [[nodiscard]] const std::array<std::uint32_t, 3>& triangle(std::uint32_t face) const noexcept {
    return structure_.triangles[face];
  }
  [[nodiscard]] const Vec3& vertex(std::uint32_t index) const noexcept { return structure_.vertices[index]; }
  [[nodiscard]] const Vec3& corner(std::uint32_t face, std::size_t k) const noexcept {
    return structure_.vertices[structure_.triangles[face][k]];
  }
  [[nodiscard]] const Face& face(std::uint32_t face) const noexcept { return faces_[face]; }

  [[nodiscard]] Bounds bounds() const noexcept { return bounds_; }
  [[nodiscard]] double mean_edge_m() const noexcept { return mean_edge_; }
  [[nodiscard]] std::size_t bytes() const noexcept;  // the memory that the mesh uses
  [[nodiscard]] std::size_t dropped_triangles() const noexcept { return structure_.dropped; }
  // Whether each edge has one face on either side.
  [[nodiscard]] bool closed() const noexcept { return structure_.closed; }

  // Returns what `find` returned in the first call. crossing_faces() (mesh_crossings.hpp) passes `find`; several parts
  // of a session ask for its result. Copies of a mesh have the same faces and share the result. For set-up, not for the
  // cycle.
  template <typename Find>
  [[nodiscard]] MeshDefect crossings(Find find) const {
    std::call_once(crossings_->asked, [&] { crossings_->found = find(); });
    return crossings_->found;
  }

  // Returns the lift (m): how far the surface that a proxy touches is in front of the triangles. The lift is so large
  // that rounding can't take a proxy in contact through the triangles.
  //
  // Derivation, where S is the largest ‖vertex‖₁:
  // 1. A computed height over the touched surface has an error of at most 16 u S (FlatSurface::rounding derives less
  //    than 8 u (‖x‖₁ + ‖point‖₁)).
  // 2. The surface's point is rounded by 3 u S, and the normal's error of 2 u adds 4 u S over the mesh. With step 1
  //    these errors are 23 u S.
  // 3. A computed height proves on which side a point is only if it exceeds doubt(), which is 32 u S.
  // 4. The sum is 55 u S. lift_m() is 64 u S: 2e-14 m for a mesh within one metre.
  [[nodiscard]] double lift_m() const noexcept { return lift_; }

  // height() returns nᵀ(x − corner), m. If |height| exceeds doubt(), the sign of height proves on which side x is.
  [[nodiscard]] static double height(const Face& face, const Vec3& x) noexcept {
    return face.normal.dot(x - face.corner);
  }
  [[nodiscard]] static double doubt(const Face& face, double size_of_x) noexcept {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    return face.trust * 16.0 * u * (size_of_x + face.corner.lpNorm<1>());
  }

  // Both are exact. side() returns on which side of the face's plane x is; touched_by() returns whether the closed
  // segment from x to y touches the closed face.
  [[nodiscard]] int side(std::uint32_t face, const Vec3& x) const noexcept;
  [[nodiscard]] bool touched_by(std::uint32_t face, const Vec3& x, const Vec3& y) const noexcept;

  // The first face that a segment from x to y touches, and the place: a rounded fraction of the path from x to y.
  struct Hit {
    std::uint32_t face = 0;
    double share = std::numeric_limits<double>::infinity();
    [[nodiscard]] bool any() const noexcept { return share <= 1.0; }
    void consider(std::uint32_t other, double at) noexcept {
      if (at < share || (at == share && other < face)) {
        share = at;
        face = other;
      }
    }
  };
  [[nodiscard]] Hit first_hit(const Vec3& x, const Vec3& y) const noexcept;
  void test(std::uint32_t index, const Face& face, const Vec3& x, const Vec3& y, double size_x, double size_y,
            Hit& hit) const noexcept {
    const double h_x = height(face, x), h_y = height(face, y);
    const double d_x = doubt(face, size_x), d_y = doubt(face, size_y);
    const int side_x = h_x > d_x ? 1 : h_x < -d_x ? -1 : side_exactly(index, x);
    const int side_y = h_y > d_y ? 1 : h_y < -d_y ? -1 : side_exactly(index, y);
    if (side_x * side_y <= 0) test_exactly(index, side_x, side_y, h_x, h_y, x, y, hit);
  }

  // Calls visit(face) for each face whose box is within `radius` (finite) of x. Stops if visit() returns false.
  template <typename Visit>
  void within(const Vec3& x, double radius, Visit visit) const noexcept {
    const double r2 = radius * radius;
    const Around around(x);
    std::uint32_t stack[kDepth];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const NodePair& pair = structure_.nodes[stack[--top]];
      const std::array<double, 2> d2 = pair.distance2(around);
      for (std::size_t k = 0; k < 2; ++k) {
        if (!(d2[k] <= r2)) continue;
        if (pair.count[k] == 0) stack[top++] = pair.first[k];
        for (std::uint32_t f = pair.first[k]; f < pair.first[k] + pair.count[k]; ++f) {
          if (!visit(f)) return;
        }
      }
    }
  }

  // Returns the distance from x to the nearest face, or `most` if no face is nearer than `most`. Before the call,
  // `near` is the face to test first, which may be any face. After the call, `near` is the nearest face.
  [[nodiscard]] double distance(const Vec3& x, double most, std::uint32_t& near) const noexcept {
    return distance_at_least(x, most, near, 1.0);
  }
  // Returns a lower bound of distance(), at least `share` of it, and tests far fewer faces than distance() does. After
  // the call, `near` is a face near x.
  [[nodiscard]] double distance_at_least(const Vec3& x, double most, std::uint32_t& near, double share) const noexcept;

  // Whether x is inside a closed mesh.
  [[nodiscard]] bool encloses(const Vec3& x) const noexcept;

  // Returns how often the surface goes around x (solid angle over 4π): about 1 inside a closed mesh, about 0 outside
  // it. Visits all faces, so it is for set-up only.
  [[nodiscard]] double winding(const Vec3& x) const noexcept;

 private:
  // Each level halves the faces, so there are at most 33 levels. A search keeps one waiting node of each level.
  static constexpr int kDepth = 64;

  template <typename Share, typename Visit>
  void along(const Vec3& x, const Vec3& y, Share share, Visit visit) const noexcept;
  TriangleMesh() = default;
  void weld(TriangleSoup& soup);
  void build();
  void empty_second_root();
  void bound();
  void make_faces();
  void check_closed();
  [[nodiscard]] double face_distance2(std::uint32_t face, const Vec3& x) const noexcept;
  [[nodiscard]] int side_exactly(std::uint32_t face, const Vec3& x) const noexcept;
  void test_exactly(std::uint32_t index, int side_x, int side_y, double h_x, double h_y, const Vec3& x, const Vec3& y,
                    Hit& hit) const noexcept;

  Structure structure_;
  std::vector<Face> faces_;
  Bounds bounds_;
  double mean_edge_ = 0.0, lift_ = 0.0;
  struct Crossings {
    std::once_flag asked;
    MeshDefect found;
  };
  std::shared_ptr<Crossings> crossings_ = std::make_shared<Crossings>();
};

}  // namespace proxarm::models

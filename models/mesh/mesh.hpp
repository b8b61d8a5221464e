// A surface of triangles with a bounding-volume tree: which faces are near, which face does a way hit first, how far is
// the nearest? Built once in double precision, then constant. Queries allocate nothing and may come from any thread.
//
// From its front, a face's corners run counter-clockwise; a body's fronts are outside. Nothing passes a face in either
// direction, so a mesh may be open, closed or a soup of triangles.
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

// Indexed triangles as in files. Metres, in the proxy's frame.
struct TriangleSoup {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// A kind of defect: how many there are, and the place of the first.
struct MeshDefect {
  std::size_t count = 0;
  Vec3 first_W = Vec3::Zero();
};

class TriangleMesh {
 public:
  // A face's data for most queries, in one cache line.
  struct alignas(64) Face {
    Vec3 corner;         // first vertex
    Vec3 normal;         // unit within 2u, out of its front
    double trust = 1.0;  // 1; infinite for a triangle so thin that its normal isn't known within 2u
    double offset;       // normalᵀ corner, rounded: for first tests only
  };

  // A point between two floats on each axis, so that distances from it are rounded down.
  struct Around {
    std::array<Eigen::Array4f, 3> x;  // {up, up, −down, −down}
    explicit Around(const Vec3& point) noexcept;
  };
  // Two nodes of the tree, in one cache line. Their boxes are rounded outwards.
  struct alignas(64) NodePair {
    std::array<Eigen::Array4f, 3> box;     // by axis: the lows of both, and −1 times their highs
    std::array<std::uint32_t, 2> first{};  // first face, or the pair of nodes below
    std::array<std::uint32_t, 2> count{};  // number of faces; 0: an inner node
    [[nodiscard]] double low(std::size_t k, Eigen::Index axis) const noexcept {
      return box[static_cast<std::size_t>(axis)][static_cast<Eigen::Index>(k)];
    }
    [[nodiscard]] double high(std::size_t k, Eigen::Index axis) const noexcept {
      return -box[static_cast<std::size_t>(axis)][static_cast<Eigen::Index>(k + 2)];
    }
    // The squared distances of a point from both boxes. Never too large; too small by at most a millionth and the
    // rounding of x to float.
    [[nodiscard, gnu::always_inline]] inline std::array<double, 2> distance2(const Around& point) const noexcept {
      Eigen::Array4f sum = Eigen::Array4f::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Eigen::Array4f out = (box[axis] - point.x[axis]).max(0.0f);
        sum += out * out;  // at most one of low and high counts
      }
      sum *= 1.0f - 1e-6f;
      return {sum[0] + sum[2], sum[1] + sum[3]};
    }
  };
  // The parts of a mesh that take long to build. A mesh restored from them is equal to the bit.
  struct Structure {
    std::vector<Vec3> vertices;                           // all used by triangles
    std::vector<std::array<std::uint32_t, 3>> triangles;  // in the tree's order
    std::vector<NodePair> nodes;                          // from the root on, which is alone in its pair
    std::uint64_t dropped = 0;                            // triangles without area that were left out
    bool closed = false;
  };

  // Merges vertices with the same coordinates. Leaves out triangles without area, which have no sides; in a mesh
  // without gaps their neighbours cover them. Sorts the others so that neighbours in space are neighbours in memory.
  // Throws std::invalid_argument if no triangle is left, an index is out of range, or a coordinate isn't finite or
  // beyond 1e9 m.
  explicit TriangleMesh(TriangleSoup soup);

  // Restores a mesh from structure() of another one. Throws std::invalid_argument if the structure would lead out of
  // bounds. Precondition: boxes contain their triangles (a cache's signature guarantees that).
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
  [[nodiscard]] std::size_t bytes() const noexcept;  // memory used
  [[nodiscard]] std::size_t dropped_triangles() const noexcept { return structure_.dropped; }
  [[nodiscard]] bool closed() const noexcept { return structure_.closed; }  // each edge has one face on either side

  // The result of the first call's find(): crossing_faces() (mesh_crossings.hpp), which several parts of a session ask
  // for. Copies of a mesh have the same faces and share the result. For set-up.
  template <typename Find>
  [[nodiscard]] MeshDefect crossings(Find find) const {
    std::call_once(crossings_->asked, [&] { crossings_->found = find(); });
    return crossings_->found;
  }

  // How far the surface that a proxy touches is in front of the triangles, metres, so that rounding can't take a proxy
  // in contact through them.
  //
  // Let S be the largest ‖vertex‖₁. A computed height over the touched surface is off by at most 16 u S
  // (FlatSurface::rounding derives less than 8 u (‖x‖₁ + ‖point‖₁)). The surface's point is rounded by 3 u S, and its
  // normal's error (2 u) adds 4 u S over the mesh: 23 u S. A computed height proves a side only above doubt(), 32 u S.
  // The sum, 55 u S, is rounded up to 64 u S: 2e-14 m for a mesh within one metre.
  [[nodiscard]] double lift_m() const noexcept { return lift_; }

  // height() is nᵀ(x − corner), m. If its size exceeds doubt(), it proves on which side x is.
  [[nodiscard]] static double height(const Face& face, const Vec3& x) noexcept {
    return face.normal.dot(x - face.corner);
  }
  [[nodiscard]] static double doubt(const Face& face, double size_of_x) noexcept {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    return face.trust * 16.0 * u * (size_of_x + face.corner.lpNorm<1>());
  }

  // The side of the face's plane on which x is, and whether a closed segment touches the closed face; both exact.
  [[nodiscard]] int side(std::uint32_t face, const Vec3& x) const noexcept;
  [[nodiscard]] bool touched_by(std::uint32_t face, const Vec3& x, const Vec3& y) const noexcept;

  // The first face that a segment touches, and where: a rounded fraction of the way from x to y.
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

  // Calls visit(face) for each face whose box comes within `radius` (finite) of x. Stops if visit() returns false.
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

  // The distance from x to the nearest face, or `most` if no face is nearer. `near` is the face to test first (any will
  // do); it becomes the nearest.
  [[nodiscard]] double distance(const Vec3& x, double most, std::uint32_t& near) const noexcept {
    return distance_at_least(x, most, near, 1.0);
  }
  // A lower bound of that distance, at least `share` of it; tests far fewer faces. `near` becomes one of the near
  // faces.
  [[nodiscard]] double distance_at_least(const Vec3& x, double most, std::uint32_t& near, double share) const noexcept;

  // Whether x is inside a closed mesh.
  [[nodiscard]] bool encloses(const Vec3& x) const noexcept;

  // How often the surface goes around x (solid angle over 4π): about 1 inside a closed mesh, 0 outside. Visits all
  // faces, so it is for set-up.
  [[nodiscard]] double winding(const Vec3& x) const noexcept;

 private:
  static constexpr int kDepth = 64;  // each level halves the faces: 33 levels at most, one waiting node each

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

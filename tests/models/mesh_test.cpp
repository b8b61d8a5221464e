// Triangle meshes: exact sides, a barrier that nothing passes, and the same contacts as flat surfaces have.
#include "models/mesh.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <memory>

#include "models/mesh_predicates.hpp"
#include "models/mesh_surface.hpp"
#include "models/plane_composition.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/contract.hpp"
#include "tests/models/exact_reference.hpp"
#include "tests/models/mesh_shapes.hpp"

namespace proxarm::tests {
namespace {

using models::Face;
using models::FlatSurface;
using models::MeshSurface;
using models::PlaneComposition;
using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

std::shared_ptr<const TriangleMesh> mesh_of(TriangleSoup soup) {
  return std::make_shared<const TriangleMesh>(std::move(soup));
}

// Grid points as doubles, and the determinant in integers: exact on both sides of zero and at it.
TEST(MeshPredicates, OrientationIsThatOfIntegers) {
  __extension__ using Wide = __int128;
  Random random(701);
  int zero = 0;
  for (std::int64_t i = 0; i < scaled(300'000); ++i) {
    const int bits = 1 + random.below(38);
    const auto whole = [&](double half) {
      return static_cast<std::int64_t>(std::llround(random.uniform(-half, half)));
    };
    std::int64_t x[4][3];
    for (auto& point : x) {
      for (auto& c : point) c = whole(std::exp2(bits));
    }
    if (random.chance(0.6)) {
      // In the plane or next to it: a whole-numbered combination, moved by −1, 0 or 1.
      const std::int64_t s = whole(3.0), t = whole(3.0);
      for (int k = 0; k < 3; ++k) x[3][k] = x[0][k] + s * (x[1][k] - x[0][k]) + t * (x[2][k] - x[0][k]);
      x[3][random.below(3)] += random.below(3) - 1;
    }
    Wide d[3][3];
    for (int r = 0; r < 3; ++r) {
      for (int k = 0; k < 3; ++k) d[r][k] = x[r + 1][k] - x[0][k];
    }
    const Wide det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                     d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                     d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    Vec3 v[4];
    const double unit = std::exp2(-random.below(60));
    for (int r = 0; r < 4; ++r) {
      for (int k = 0; k < 3; ++k) v[r][k] = unit * static_cast<double>(x[r][k]);
    }
    ASSERT_EQ(models::orientation(v[0], v[1], v[2], v[3]), (det > 0) - (det < 0)) << "bits " << bits;
    zero += det == 0 ? 1 : 0;
  }
  EXPECT_GT(zero, 1000 * scaled(1) / 2);
}

TEST(MeshPredicates, SegmentsTouchAtFacesEdgesAndVerticesAndInThePlane) {
  const Vec3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const auto touches = [&](const Vec3& x, const Vec3& y) {
    const bool once = models::segment_touches_triangle(x, y, a, b, c);
    EXPECT_EQ(once, models::segment_touches_triangle(y, x, c, b, a));
    return once;
  };
  EXPECT_TRUE(touches({0.2, 0.2, 1}, {0.2, 0.2, -1}));
  EXPECT_TRUE(touches({0.2, 0.2, 1}, {0.2, 0.2, 0}));
  EXPECT_FALSE(touches({0.2, 0.2, 1}, {0.2, 0.2, 1e-60}));
  EXPECT_TRUE(touches({0.5, 0.5, 1}, {0.5, 0.5, -1})) << "edge";
  EXPECT_TRUE(touches({1, 0, 1}, {1, 0, -1})) << "vertex";
  EXPECT_FALSE(touches({0.5, std::nextafter(0.5, 1.0), 1}, {0.5, std::nextafter(0.5, 1.0), -1})) << "beside an edge";
  EXPECT_TRUE(touches({-1, 0.2, 0}, {2, 0.2, 0})) << "through, in the plane";
  EXPECT_TRUE(touches({0.2, 0.2, 0}, {0.3, 0.3, 0})) << "within, in the plane";
  EXPECT_TRUE(touches({2, 0, 0}, {1, 0, 0})) << "along an edge up to its end";
  EXPECT_FALSE(touches({2, 0, 0}, {std::nextafter(1.0, 2.0), 0, 0})) << "along an edge, short of it";
  EXPECT_FALSE(touches({2, -1, 0}, {2, 1, 0}));
  EXPECT_FALSE(touches({0, 2, 0}, {2, 0.5, 0}));
}

TEST(TriangleMesh, RefusesWhatIsNoMesh) {
  const double nan = std::nan("");
  EXPECT_THROW(TriangleMesh(TriangleSoup{}), std::invalid_argument);
  EXPECT_THROW(TriangleMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}}), std::invalid_argument);
  EXPECT_THROW(TriangleMesh({{{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}, {{0, 1, 2}}}), std::invalid_argument);
  EXPECT_THROW(TriangleMesh({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}), std::invalid_argument) << "no area";
  EXPECT_THROW(MeshSurface(mesh_of(block({1, 1, 1})), -0.1), std::invalid_argument);
  EXPECT_THROW(MeshSurface(mesh_of(block({1, 1, 1})), nan), std::invalid_argument);
}

TEST(TriangleMesh, WeldsVerticesAndDropsTrianglesWithoutArea) {
  TriangleSoup soup;
  for (const auto& t : block({1, 1, 1}).triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const auto v : t) soup.vertices.push_back(block({1, 1, 1}).vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
    soup.triangles.push_back({first, first + 1, first + 1});
  }
  const TriangleMesh mesh(soup);
  EXPECT_EQ(mesh.size(), 12u);
  EXPECT_EQ(mesh.dropped_triangles(), 12u);
  EXPECT_TRUE(mesh.closed());
  EXPECT_NEAR(mesh.winding({0.1, 0.2, 0.3}), 1.0, 1e-12);
  EXPECT_NEAR(mesh.winding({0.1, 0.2, 0.6}), 0.0, 1e-12);
  Random random(700);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = random.in_box<3>(1.0);
    ASSERT_EQ(mesh.encloses(x), x.cwiseAbs().maxCoeff() < 0.5);
  }
  soup.triangles.pop_back();
  soup.triangles.pop_back();
  EXPECT_FALSE(TriangleMesh(soup).closed());
}

// What a file says of it may be anything: refused, or of no consequence but wrong answers.
TEST(TriangleMesh, RefusesADamagedStructure) {
  const TriangleMesh mesh(ball(2, 0.5));
  const auto refused = [](TriangleMesh::Structure structure) {
    EXPECT_THROW((void)TriangleMesh::restored(std::move(structure)), std::invalid_argument);
  };
  auto s = mesh.structure();
  refused({});
  s.vertices.pop_back();
  refused(s);
  s = mesh.structure();
  s.triangles.pop_back();
  refused(s);
  s = mesh.structure();
  s.nodes[0].first[0] = 0;
  refused(s);
  s = mesh.structure();
  s.nodes.pop_back();
  refused(s);
  s = mesh.structure();
  s.vertices[7].y() = std::nan("");
  refused(s);

  Random random(704);
  std::int64_t taken = 0;
  for (std::int64_t i = 0; i < scaled(3000); ++i) {
    s = mesh.structure();
    auto& pair = s.nodes[static_cast<std::size_t>(random.below(static_cast<int>(s.nodes.size())))];
    std::array<unsigned char, sizeof(pair)> bytes{};
    std::memcpy(bytes.data(), static_cast<const void*>(&pair), sizeof(pair));
    for (int k = 0; k < 3; ++k) {
      bytes[static_cast<std::size_t>(random.below(sizeof(pair)))] = static_cast<unsigned char>(random.below(256));
    }
    std::memcpy(static_cast<void*>(&pair), bytes.data(), sizeof(pair));
    try {
      const TriangleMesh same = TriangleMesh::restored(std::move(s));
      ++taken;
      std::uint32_t near = 0;
      const Vec3 x = random.in_box<3>(1.0), y = random.in_box<3>(1.0);
      EXPECT_GE(same.distance(x, 1e9, near), 0.0);
      EXPECT_LT(near, same.size());
      EXPECT_LT(same.first_hit(x, y).face, same.size());
    } catch (const std::invalid_argument&) {
    }
  }
  EXPECT_GT(taken, scaled(100) / 2);
}

TEST(TriangleMesh, FindsTheNearestFaceAndTheFirstHit) {
  Random random(702);
  TriangleSoup soup;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const Vec3 at = random.in_box<3>(1.0);
    const double size = random.log_uniform(1e-4, 0.5);
    for (int k = 0; k < 3; ++k) soup.vertices.push_back(at + size * random.in_box<3>(1.0));
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const TriangleMesh mesh(soup);
  std::uint32_t near = 0;
  for (std::int64_t i = 0; i < scaled(5000); ++i) {
    const Vec3 x = random.in_box<3>(1.5), y = x + random.log_uniform(1e-3, 2.0) * random.direction<3>();
    // A long double walk over all: the nearest of many points wouldn't be exact, so by the plane and by the sides.
    Real least = 1e9L;
    bool any = false;
    std::uint32_t brute = 0;
    Real brute_share = 2.0L;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
      const RVec p = x.cast<Real>(), v[3] = {mesh.corner(f, 0).cast<Real>(), mesh.corner(f, 1).cast<Real>(),
                                             mesh.corner(f, 2).cast<Real>()};
      const RVec n = (v[1] - v[0]).cross(v[2] - v[0]).normalized();
      bool within = true;
      for (int k = 0; k < 3; ++k) {
        const RVec e = v[(k + 1) % 3] - v[k], d = p - v[k];
        within = within && e.cross(n).dot(d) <= 0;
        least = std::min(least, (d - e * std::clamp(e.dot(d) / e.squaredNorm(), Real(0), Real(1))).norm());
      }
      if (within) least = std::min(least, std::abs(n.dot(p - v[0])));
      if (mesh.touched_by(f, x, y)) {
        any = true;
        const Real fall = n.dot(p - y.cast<Real>()), share = n.dot(p - v[0]) / fall;
        if (share < brute_share) {
          brute_share = share;
          brute = f;
        }
      }
    }
    ASSERT_NEAR(mesh.distance(x, 1e9, near), static_cast<double>(least), 1e-14);
    const TriangleMesh::Hit hit = mesh.first_hit(x, y);
    ASSERT_EQ(hit.any(), any);
    if (any) {
      ASSERT_EQ(hit.face, brute);
      ASSERT_NEAR(hit.share, static_cast<double>(brute_share), 1e-12);
    }
  }
}

TEST(MeshSurface, OfABlockFromInsideIsTheCompositionOfItsSides) {
  Random random(703);
  const Vec3 half(0.5, 0.4, 0.3);
  const auto mesh = mesh_of(block(2.0 * half));
  // As far inside as the surface that is touched: a composition takes a q that is 1e-14 m off a groove for one that
  // arrives from beside it, and that is another friction.
  const double lift = mesh->lift_m();
  EXPECT_LE(lift, 1e-14);
  std::vector<Face> faces;
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {-1.0, 1.0}) {
      faces.push_back({FlatSurface<3>(sign * (half[k] - lift) * Vec3::Unit(k), -sign * Vec3::Unit(k)), 0.3});
    }
  }
  std::vector<ReferenceFace> reference_faces;
  for (const Face& f : faces) {
    reference_faces.push_back({f.surface.point().cast<Real>(), f.surface.normal().cast<Real>(), 0.3L});
  }
  const ExactReference reference(reference_faces);
  std::int64_t asked = 0;
  PlaneComposition planes(faces);
  MeshSurface g(mesh, 0.3);
  std::int64_t touched[4] = {0, 0, 0, 0};
  Vec3 q = Vec3::Zero();
  for (std::int64_t i = 0; i < scaled(200'000); ++i) {
    Vec3 p = q + random.log_uniform(1e-9, 1.0) * random.direction<3>();
    if (random.chance(0.3)) p = q + random.log_uniform(1e-6, 0.3) * (random.direction<3>() + q.cwiseQuotient(half));
    const Vec3 r = g(1.0, p, q), expected = planes(1.0, p, q);
    if ((r - expected).norm() > 1e-12) {
      // The composition's lines start far from a short slide, whose roots then drown in rounding: brute force decides.
      ++asked;
      double off = 1.0;
      for (const auto& solution : reference.solve(p.cast<Real>(), q.cast<Real>(), true)) {
        off = std::min(off, static_cast<double>((solution.r - r.cast<Real>()).norm()));
      }
      ASSERT_LE(off, 1e-12) << state_text<3>(1.0, p, q, r) << "\n expected " << expected.transpose();
    }
    ++touched[g.contacts().size()];
    q = random.chance(0.01) ? Vec3::Zero() : r;
  }
  std::cout << "  contacts 0: " << touched[0] << ", 1: " << touched[1] << ", 2: " << touched[2] << ", 3: " << touched[3]
            << ", brute force asked " << asked << " times\n";
  EXPECT_EQ(g.unresolved_steps(), 0u);
}

// Steps small against the bodies, as a proxy's are; deeper ones have several solutions on a mesh that isn't convex.
ContractOptions<3> small_steps(double mu, double depth = 0.02) {
  ContractOptions<3> options;
  options.states = 8000;
  options.friction = {mu};
  options.size_m = depth;
  options.near_surface = true;
  options.kappa_decades = 2.0;
  options.reach_m = depth;
  return options;
}

TEST(Contract, Meshes) {
  for (const double mu : {0.0, 0.3}) {
    ContractOptions<3> smooth = small_steps(mu);
    // At an edge the proxy may stick on one face or slide on the other; one step may end on either side of a ridge.
    smooth.several = 6e-3;
    expect_contract<3>(MeshSurface(mesh_of(block({0.8, 0.9, 1.0})), mu), smooth);
    expect_contract<3>(MeshSurface(mesh_of(ball(3, 0.5)), mu), smooth);
    const auto hills = [](double x, double y) { return 0.1 * std::sin(9 * x) * std::cos(7 * y); };
    expect_contract<3>(MeshSurface(mesh_of(field(24, 3.0, hills)), mu), smooth);
  }
}

// Where the proxy touches one face alone and far enough from its sides to be held by no other.
bool on_one_face(const MeshSurface& g, const Vec3& q) {
  if (g.contacts().size() != 1) return false;
  const auto face = static_cast<std::uint32_t>(g.contacts()[0].feature);
  const TriangleMesh& mesh = g.mesh();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = mesh.corner(face, k), e = mesh.corner(face, (k + 1) % 3) - a;
    if (e.cross(mesh.face(face).normal).normalized().dot(q - a) > -1e-5) return false;
  }
  return true;
}

TEST(MeshSurface, SticksBitForBitAndNeverCreeps) {
  Random random(705);
  for (TriangleSoup soup : {block({0.8, 0.9, 1.0}), ball(3, 0.5), ball(5, 0.5), globe(10, 50, 0.5)}) {
    MeshSurface g(mesh_of(std::move(soup)), 0.3);
    std::int64_t stuck = 0;
    for (std::int64_t i = 0; i < scaled(2000); ++i) {
      Vec3 q = random.direction<3>();
      q = g(1e6, 0.45 * q, q);
      if (!on_one_face(g, q)) continue;
      const Vec3 n = g.contacts()[0].normal;
      q = g(1e6, q - 1e-6 * n, q);
      const Vec3 start = q;
      for (int k = 0; k < 20; ++k) {
        const double push = random.log_uniform(1e-3, 5000.0);
        const Vec3 t = n.cross(random.direction<3>());
        q = g(1e6, q + (random.uniform(0.0, 0.299) * push * t - push * n) / 1e6, q);
        ASSERT_EQ(q, start) << "crept by " << (q - start).norm();
      }
      ++stuck;
    }
    EXPECT_GT(stuck, scaled(400));
  }
}

// A push over the cone by a part in a million moves it.
TEST(MeshSurface, SlidesFromRestAboveTheCone) {
  MeshSurface g(mesh_of(ball(4, 0.5)), 0.3);
  Random random(706);
  for (std::int64_t i = 0; i < scaled(2000); ++i) {
    const Vec3 away = random.direction<3>();
    Vec3 q = g(1e6, 0.49 * away, away);
    if (!on_one_face(g, q)) continue;
    const Vec3 n = g.contacts()[0].normal;
    q = g(1e6, q - 1e-6 * n, q);
    const Vec3 t = n.cross(random.direction<3>()).normalized();
    const Vec3 r = g(1e6, q + 5e-6 * (0.3 * (1.0 + 1e-6) * t - n), q);
    EXPECT_NE(r, q);
    EXPECT_NEAR((r - q).norm(), 5e-6 * 0.3e-6, 1e-15);  // coordinates of half a metre are rounded to 6e-17
  }
}

// One face, by long double arithmetic on its vertices; also after the step has crossed an edge.
TEST(MeshSurface, EndsWhereEquation4SaysOnTheFaceThatItTouches) {
  Random random(707);
  const auto mesh = mesh_of(ball(4, 0.5));
  const double mu = 0.2;
  MeshSurface g(mesh, mu);
  std::int64_t single = 0, crossed = 0;
  std::int32_t last = -1;
  Vec3 q(0, 0, 0.6);
  for (std::int64_t i = 0; i < scaled(100'000); ++i) {
    const Vec3 p = q * (1.0 - random.log_uniform(1e-7, 1e-2)) + random.log_uniform(1e-7, 1e-2) * random.direction<3>();
    const Vec3 r = g(1e6, p, q);
    if (g.contacts().size() == 1) {
      ++single;
      const auto f = static_cast<std::uint32_t>(g.contacts()[0].feature);
      crossed += g.contacts()[0].feature != last ? 1 : 0;
      last = g.contacts()[0].feature;
      const RVec a = mesh->corner(f, 0).cast<Real>(), b = mesh->corner(f, 1).cast<Real>(),
                 c = mesh->corner(f, 2).cast<Real>();
      const RVec n = (b - a).cross(c - a).normalized(), P = p.cast<Real>(), Q = q.cast<Real>();
      const Real h = n.dot(P - a);
      ASSERT_LE(h, 1e-14L);
      const RVec p_sf = P - n * h, q_sf = Q - n * n.dot(Q - a), d = p_sf - q_sf;
      const RVec expected = d.norm() <= -mu * h ? q_sf : RVec(p_sf + mu * h * d / d.norm());
      // The proxy touches a lift (64 u S, 7e-15 m here) in front of the face.
      ASSERT_LE((expected - r.cast<Real>()).norm(), 5e-14L) << state_text<3>(1e6, p, q, r);
      for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
        ASSERT_LE((to - from).cross(n).normalized().dot(r.cast<Real>() - from), 1e-13L) << "off the face";
      }
    }
    q = r.norm() < 0.7 ? r : Vec3(0, 0, 0.6);
  }
  std::cout << "  " << single << " single contacts, " << crossed << " after crossing an edge\n";
  EXPECT_GT(crossed, single / 40);
}

TEST(MeshSurface, TakesNothingFromTheHeap) {
  if (!allocations_are_counted()) GTEST_SKIP() << "the sanitizer's malloc can't be counted";
  Random random(708);
  MeshSurface g(mesh_of(ball(4, 0.5)), 0.3);
  Vec3 q(0, 0, 0.6);
  const std::uint64_t before = allocation_count();
  for (std::int64_t i = 0; i < 20'000; ++i) {
    q = g(1e6, 0.999 * q + random.log_uniform(1e-6, 0.3) * random.direction<3>(), q);
  }
  EXPECT_EQ(allocation_count(), before);
}

TEST(MeshSurface, TakesNoNonsense) {
  MeshSurface g(mesh_of(ball(2, 0.5)), 0.3);
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const Vec3 q(0, 0, 0.6);
  EXPECT_EQ(g(1e6, {nan, 0, 0}, q), q);
  EXPECT_EQ(g(1e6, {0, 0, -inf}, q), q);
  for (const double far : {1e3, 1e12, 1e100, 1e300}) {
    const Vec3 r = g(1e6, {0, 0, -far}, q);
    EXPECT_TRUE(r.allFinite());
    EXPECT_GE(r.norm(), 0.3);
    EXPECT_EQ(g(1e6, {0, 0, far}, q), Vec3(0, 0, far));
  }
}

// A surface that has just been made holds no face, so it walks. In steps of nanometres to centimetres, pushed into the
// surface and along it, so that a proxy glides far, over edges and off the surface.
TEST(MeshSurface, GlidesWhereTheWalkGoesBitForBit) {
  constexpr std::uint64_t seed = 31;
  Random random(seed);
  std::int64_t in_contact = 0;
  for (const auto& mesh : {mesh_of(ball(4, 0.5)), mesh_of(block({0.8, 0.9, 1.0}))}) {
    for (const double mu : {0.0, 0.3}) {
      MeshSurface g(mesh, mu);
      Vec3 q = Vec3::Zero();
      const std::int64_t steps = scaled(25'000);
      for (std::int64_t i = 0; i < steps; ++i) {
        if (i % 500 == 0) {  // from afar onto the surface
          const Vec3 far = random.direction<3>();
          q = g(1e6, 0.2 * far, far);
        }
        const double size = random.log_uniform(1e-9, 1e-2);
        const Vec3 p = q + size * (random.direction<3>() - 0.5 * q.normalized());
        const Vec3 r = g(1e6, p, q);
        MeshSurface walks(mesh, mu);
        const Vec3 walked = walks(1e6, p, q);
        ASSERT_EQ(r, walked) << state_text<3>(1e6, p, q, r) << ", seed " << seed << ", state " << i;
        ASSERT_EQ(g.contacts().size(), walks.contacts().size());
        for (std::size_t c = 0; c < g.contacts().size(); ++c) {
          ASSERT_EQ(g.contacts()[c].feature, walks.contacts()[c].feature);
          ASSERT_EQ(g.contacts()[c].slips, walks.contacts()[c].slips);
        }
        in_contact += g.contacts().empty() ? 0 : 1;
        q = r;
      }
    }
  }
  std::cout << "  " << in_contact << " steps in contact, seed " << seed << "\n";
  EXPECT_GT(in_contact, scaled(30'000));
}

}  // namespace
}  // namespace proxarm::tests

// A proxy on a mesh: the same contacts as on flat surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "models/mesh/mesh_surface.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/contract.hpp"
#include "tests/models/surfaces/exact_reference.hpp"

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
    EXPECT_GT(stuck, scaled(200));  // a quarter lie so on the finest; of a sanitizer's 100, chance takes some
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

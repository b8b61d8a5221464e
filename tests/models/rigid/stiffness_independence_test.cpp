// Assumption 1 of a rigid tool (models/geometry/pose_algorithm.hpp): where a tool comes to under a wrench doesn't
// depend on the stiffness that carries it. A step leads to r with contacts that bear w; by another stiffness K', any
// symmetric positive definite one, the same wrench pulls from p̂' = moved(r, −K'⁻¹w), and 𝒢(K', p̂', q) must be r again.
//
// Coulomb's law may have several solutions: where K' couples what presses with what slides, a tool that p̂' leads away
// from the surface may as well be held by it (Painlevé), one that hardly slips may stick, and of a box that turns on a
// plane four corners share the load as they like. A solution that isn't r is judged by formulas of its own, and
// counted.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <iostream>
#include <string>

#include "models/rigid/rigid_world.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/rigid_judges/rigid_bodies.hpp"
#include "tests/models/rigid_judges/rigid_hollows.hpp"
#include "tests/models/rigid_judges/rigid_judge.hpp"
#include "tests/models/rigid_judges/rigid_meshes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

// A tool that starts outside of everything, and where it is sent: to the middle or away from it.
struct Place {
  Tool tool;
  std::vector<RigidObject> objects;
  std::vector<double> mu;                        // of each object
  std::function<double(const ToolPose&)> apart;  // m, by formulas that share nothing with the step
  ToolPose start;
  bool outwards = false;

  void add(decltype(RigidObject::shape) shape, double friction) {
    RigidObject object;
    object.shape = std::move(shape);
    object.friction = friction;
    object.object = static_cast<std::int32_t>(objects.size());
    mu.push_back(friction);
    objects.push_back(std::move(object));
  }
};

double random_friction(Random& random) { return random.chance(0.2) ? 0.0 : random.uniform(0.0, 0.8); }

// A pose, as the judge finds it, outside of everything.
ToolPose somewhere(Random& random, double half, const Place& place) {
  ToolPose q;
  do {
    q = tool_pose(random_pose(random, half));
  } while (place.apart(q) < 1e-3);
  return q;
}

// -- the comparison ---------------------------------------------------------------------------------------------------

constexpr double kLever_m = 0.03;  // by which rotations are taken as lengths: about the tools' reach

// m, rad → m.
Twist in_metres(const Twist& xi) {
  Twist out = xi;
  out.tail<3>() *= kLever_m;
  return out;
}

// Any symmetric positive definite one: its axes lie across translations and rotations, its eigenvalues (N/m, of
// rotations at the lever) go from 1 to `condition`.
Mat6 random_stiffness(Random& random, double condition) {
  Mat6 A;
  for (int i = 0; i < 36; ++i) A.data()[i] = random.uniform(-1.0, 1.0);
  const Mat6 axes = Eigen::HouseholderQR<Mat6>(A).householderQ();
  Twist values, levers;
  values << 1.0, condition, 0.0, 0.0, 0.0, 0.0;
  for (int i = 2; i < 6; ++i) values[i] = random.log_uniform(1.0, condition);
  levers << Vec3::Ones(), Vec3::Constant(kLever_m);
  const Mat6 half = levers.asDiagonal() * axes * values.cwiseSqrt().asDiagonal();
  return half * half.transpose();
}

// A step of K's, with what its contacts bear.
struct Solution {
  ToolPose q, r;
  Twist wrench = Twist::Zero();
  int bearing = 0;            // contacts
  bool slips = false;         // one of them
  double least_slip_m = 1e9;  // of those with friction
};

Solution solution_of(std::span<const PoseContact> contacts, const ToolPose& q, const ToolPose& r) {
  Solution out{q, r};
  for (const PoseContact& contact : contacts) {
    const Vec3 lever = contact.point_W - r.position;
    out.wrench.head<3>() += contact.force_W;
    out.wrench.tail<3>() += lever.cross(contact.force_W);
    if (!(contact.force_W.norm() > 0.0)) continue;
    ++out.bearing;
    if (!contact.slips || contact.friction == 0.0) continue;
    const Vec3 way = contact.point_W - q * (r.orientation.conjugate() * lever);
    out.slips = true;
    out.least_slip_m = std::min(out.least_slip_m, (way - contact.normal_W * contact.normal_W.dot(way)).norm());
  }
  return out;
}

// Another stiffness that carries the same wrench.
struct Other {
  Mat6 K;
  ToolPose p_hat;
  double condition = 1.0, least = 0.0;  // N/m: its smallest eigenvalue
  double depth_m = 0.0;                 // from p̂' to the solution
};

Other random_other(Random& random, const Solution& solution) {
  Other out;
  out.condition = random.log_uniform(1.0, 1e6);
  out.depth_m = random.log_uniform(1e-7, 1e-3);
  out.K = random_stiffness(random, out.condition);
  out.least = in_metres(out.K.ldlt().solve(solution.wrench)).norm() / out.depth_m;
  out.K *= out.least;
  out.p_hat = moved(solution.r, -out.K.ldlt().solve(solution.wrench));
  return out;
}

// Rounding of a pose, as a length.
double rounding_m(const ToolPose& r) {
  return std::numeric_limits<double>::epsilon() * (r.position.lpNorm<1>() + kLever_m);
}

// How far apart two solutions of the same problem may be. Each of these is a rounding ε(‖x‖ + l), or what rounding does
// to the wrench as a share of it, times what it moves the tool by; 64 for some operations of each, as in
// tests/models/surfaces/contract.hpp:
// - of p̂': in the metric of K' nothing moves by more than p̂' does, in metres by √condition times as much;
// - of r, times K, is the wrench's, which K' yields to by 1/k', its smallest eigenvalue;
// - of a slip s turns friction by ε/s, and that moves the tool by the wrench/k' times as much.
// And the local problem is solved to 1e-12 of the press ‖Lᵀ(r ⊟ p̂')‖, which is 1e-12 √condition of the depth.
double allowed_m(const Solution& solution, const Mat6& K, const Other& other) {
  const double softest = std::sqrt(other.condition), stiffest = std::max(K(0, 0), K(3, 3) / (kLever_m * kLever_m));
  Twist wrench = solution.wrench;
  wrench.tail<3>() /= kLever_m;
  const double yield_m = wrench.norm() / other.least;
  const double allowed =
      64.0 * rounding_m(solution.r) * (softest + stiffest / other.least + yield_m / solution.least_slip_m) +
      1e-12 * softest * other.depth_m;
  return std::min(allowed, 1e-10);  // of slips that rounding alone may be all of
}

// What the law asks. `stiffest`, an eigenvalue of K (N/m), makes forces of a pose's rounding.
testing::AssertionResult is_lawful(const PoseAlgorithm& g, const Place& place, const Mat6& K, double stiffest,
                                   const ToolPose& p, const ToolPose& q, const ToolPose& r) {
  const double apart = place.apart(r), noise_N = 16.0 * stiffest * rounding_m(r);
  if (apart < -1e-12) return testing::AssertionFailure() << "inside by " << -apart << " m";
  if (g.contacts().empty()) {
    if (r == p) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "a wrench of nothing";
  }
  const LawFigures law = judge_law(g.contacts(), K, p, q, r, place.mu);
  double size = 1e-300;
  for (const PoseContact& contact : g.contacts()) size = std::max(size, contact.force_W.norm());
  const double off = imbalance(g.contacts(), K, p, r);
  // As in hollow_worlds_test.cpp: where contacts hold each other, a local problem is solved to 1e-10 of a step.
  if (off > 1e-9 + noise_N / size) return testing::AssertionFailure() << "a wrench off balance by " << off;
  if (law.outside_cone > 1e-12) return testing::AssertionFailure() << "out of the cone by " << law.outside_cone;
  if (law.against_slip > 1e-8) return testing::AssertionFailure() << "not against the slip by " << law.against_slip;
  if (law.pull > 0.0) return testing::AssertionFailure() << "pulls by " << law.pull;
  if (law.gap_m > 1e-12) return testing::AssertionFailure() << "presses over a gap of " << law.gap_m << " m";
  return testing::AssertionSuccess();
}

struct Independence {
  std::int64_t steps = 0, unresolved = 0;                 // with K
  std::int64_t compared = 0, slipping = 0, together = 0;  // of these on several contacts
  std::int64_t unresolved_again = 0;                      // with K'
  std::int64_t others = 0, free = 0;  // another lawful solution; of these at p̂' itself, which is outside of everything
  std::int64_t mild = 0, mild_others = 0;  // K' of a condition below 10
  double furthest_m = 0.0, of_allowed = 0.0, nearest_other_m = 1e9;
};

void compare(const Solution& solution, const Mat6& K, const Other& other, RigidWorld& again, const Place& place,
             const std::string& where, Independence& out) {
  const bool mild = other.condition < 10.0;
  ++out.compared;
  out.mild += mild ? 1 : 0;
  out.slipping += solution.slips ? 1 : 0;
  out.together += solution.bearing > 1 ? 1 : 0;
  const ToolPose found = again.step(other.K, other.p_hat, solution.q);
  const double off = in_metres(difference(found, solution.r)).norm(), allowed = allowed_m(solution, K, other);
  if (again.unresolved()) {
    ++out.unresolved_again;
  } else if (off <= allowed) {
    out.furthest_m = std::max(out.furthest_m, off);
    out.of_allowed = std::max(out.of_allowed, off / allowed);
  } else {
    ++out.others;
    out.free += again.contacts().empty() ? 1 : 0;
    out.mild_others += mild ? 1 : 0;
    out.nearest_other_m = std::min(out.nearest_other_m, off);
    EXPECT_TRUE(is_lawful(again, place, other.K, other.condition * other.least, other.p_hat, solution.q, found))
        << where << ": by a stiffness of condition " << other.condition << " it comes to another pose, " << off
        << " m off where " << allowed << " m are allowed, that doesn't keep the law";
  }
}

// A tool is sent to what there is, fast until it touches and then by what (26) moves it in a millisecond; each solution
// is compared with another stiffness's.
void compare_in(const Place& place, std::uint64_t seed, Independence& out) {
  Random random(seed);
  const RigidWorld unused(place.tool, place.objects);
  RigidWorld g(unused), again(unused);
  const double M = random.log_uniform(0.5, 20.0), J = M * random.log_uniform(1e-4, 1e-2);
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(1e6 * M), Vec3::Constant(1e6 * J);
  const double stiffest = std::max(K(0, 0), K(3, 3) / (kLever_m * kLever_m));
  ToolPose q = place.start;
  Twist way = Twist::Zero();
  bool touched = false;
  for (int k = 0; k < 200; ++k) {
    const bool touches = !g.contacts().empty();
    if (k % 10 == 0 || touches != touched) {
      const Vec3 away = q.position.norm() > 1e-9 ? Vec3(q.position.normalized()) : random.direction();
      const double size = touches ? random.log_uniform(1e-7, 3e-4) : 2e-3;
      way.head<3>() = (place.outwards ? size : -size) * away + random.in_box(size);
      way.tail<3>() = random.log_arrow(1e-6, 1e-2);
      touched = touches;
    }
    again.copy_state(g);
    const ToolPose p = moved(q, way), r = g.step(K, p, q);
    ++out.steps;
    const Solution solution = solution_of(g.contacts(), q, r);
    if (g.unresolved()) {
      ++out.unresolved;
    } else if (solution.bearing > 0 && solution.wrench.norm() > 0.0) {
      const std::string where = "seed " + std::to_string(seed) + ", step " + std::to_string(k);
      EXPECT_TRUE(is_lawful(g, place, K, stiffest, p, q, r)) << where;
      const Other other = random_other(random, solution);
      // One time in four by a world that knows nothing of the steps before.
      if (random.chance(0.25)) again.copy_state(unused);
      compare(solution, K, other, again, place, where, out);
    }
    q = r;
  }
}

// PROXARM_RIGID_SEED=seed looks at that world alone.
void expect_independent(const char* name, std::uint64_t first_seed, const std::function<Place(Random&)>& make) {
  const char* alone = std::getenv("PROXARM_RIGID_SEED");
  const std::int64_t worlds = alone != nullptr ? 1 : tests::scaled(20, 20);
  Independence out;
  for (std::int64_t i = 0; i < worlds; ++i) {
    const std::uint64_t seed =
        alone != nullptr ? std::strtoull(alone, nullptr, 10) : first_seed + static_cast<std::uint64_t>(i);
    Random random(seed);
    const Place place = make(random);
    compare_in(place, seed, out);
  }
  const std::int64_t same = out.compared - out.others - out.unresolved_again;
  std::cout << "  " << name << ": " << out.steps << " steps, seeds from " << first_seed << ", " << out.unresolved
            << " unresolved; with another stiffness " << out.compared << " (" << out.slipping << " slipping, "
            << out.together << " on several contacts): the same in " << same << ", off by at most " << out.furthest_m
            << " m, " << out.of_allowed << " of what is allowed; another lawful solution in " << out.others << " ("
            << out.free << " of them free; " << out.mild_others << " of " << out.mild
            << " with a condition below 10), the nearest " << out.nearest_other_m << " m off; unresolved "
            << out.unresolved_again << "\n";
  if (alone != nullptr) return;
  const auto share = [](double of, std::int64_t count) { return 3.0 + of * static_cast<double>(count); };
  EXPECT_GT(out.compared, out.steps / 5) << "or else this looks at nothing";
  EXPECT_LE(static_cast<double>(out.others), share(0.04, out.compared));
  EXPECT_LE(static_cast<double>(out.mild_others), share(0.005, out.mild));
  EXPECT_LE(static_cast<double>(out.unresolved_again), share(0.005, out.compared));
}

// -- tools and worlds -------------------------------------------------------------------------------------------------

enum class Kind { sphere, capsule, box, compound };

std::vector<Body> random_parts(Random& random, Kind kind) {
  Body part;
  if (kind == Kind::sphere || kind == Kind::capsule) part.radius = random.uniform(0.003, 0.02);
  if (kind == Kind::capsule) part.size.z() = random.uniform(0.01, 0.05);
  if (kind == Kind::box) part.size = random_size(random, 0.01, 0.05);
  if (kind != Kind::compound) return {part};
  std::vector<Body> parts = {random_body(random, 0.01, 0.03), random_body(random, 0.01, 0.03)};
  for (Body& body : parts) body.X = random_pose(random, 0.02);
  return parts;
}

Tool tool_of(const std::vector<Body>& parts) {
  Tool tool;
  for (const Body& part : parts) tool.parts.push_back({shape_of(part), part.X, {}});
  return tool;
}

// The corners of a part's core; all of it is within its radius of their hull.
std::vector<Vec3> corners_of(const Body& part) { return polyhedron_of_box(part.size, part.X).corners; }

Place among_solids(Random& random, Kind kind) {
  Place place;
  const std::vector<Body> parts = random_parts(random, kind);
  place.tool = tool_of(parts);
  std::vector<Body> bodies;
  for (int i = 0; i < 6; ++i) {
    Body body = random_body(random, 0.02, 0.1);
    body.X = random_pose(random, 0.08);
    place.add(solid_of_body(body), random_friction(random));
    bodies.push_back(body);
  }
  place.apart = [=](const ToolPose& pose) {
    double gap = 1.0;
    for (const Body& part : parts) {
      for (const Body& body : bodies) gap = std::min(gap, apart(at(part, isometry(pose)), body));
    }
    return gap;
  };
  place.start = somewhere(random, 0.15, place);
  return place;
}

ConvexTool random_hull(Random& random) {
  ConvexTool hull;
  const int count = 4 + random.below(5);
  for (int i = 0; i < count; ++i) hull.points_m.push_back(random.uniform(0.01, 0.03) * random.direction());
  return hull;
}

Place hull_among_boxes(Random& random) {
  Place place;
  const ConvexTool hull = random_hull(random);
  place.tool.parts = {{hull, Pose::Identity(), {}}};
  const Polyhedron body = polyhedron_of_hull(hull.points_m);
  std::vector<Polyhedron> boxes;
  for (int i = 0; i < 5; ++i) {
    const Vec3 size = random_size(random, 0.02, 0.1);
    const Pose X = random_pose(random, 0.08);
    place.add(solid_of(BoxTool{size}, X), random_friction(random));
    boxes.push_back(polyhedron_of_box(size, X));
  }
  place.apart = [=](const ToolPose& pose) {
    double gap = 1.0;
    for (const Polyhedron& box : boxes) gap = std::min(gap, separation(at(body, pose), box));
    return gap;
  };
  place.start = somewhere(random, 0.15, place);
  return place;
}

// A floor and two walls that lean, through places near the origin, seen from above all of them.
Place on_planes(Random& random, int kind) {
  Place place;
  std::vector<std::pair<std::vector<Vec3>, double>> cores;
  if (kind < 4) {
    const std::vector<Body> parts = random_parts(random, static_cast<Kind>(kind));
    place.tool = tool_of(parts);
    for (const Body& part : parts) cores.emplace_back(corners_of(part), part.radius);
  } else {
    const ConvexTool hull = random_hull(random);
    place.tool.parts = {{hull, Pose::Identity(), {}}};
    cores.emplace_back(hull.points_m, 0.0);
  }
  std::vector<FlatSide> planes;
  for (int i = 0; i < 3; ++i) {
    const Vec3 n = i == 0 ? Vec3(Vec3::UnitZ()) : Vec3(random.in_box(1.0) + Vec3::UnitZ()).normalized();
    planes.push_back({n, random.uniform(-0.01, 0.01)});
    place.add(planes.back(), random_friction(random));
  }
  place.apart = [=](const ToolPose& pose) {
    double gap = 1.0;
    for (const auto& [corners, radius] : cores) {
      for (const Vec3& corner : corners) {
        for (const FlatSide& plane : planes)
          gap = std::min(gap, plane.normal.dot(pose * corner) - plane.offset - radius);
      }
    }
    return gap;
  };
  do {
    place.start = tool_pose(random_pose(random, 0.02));
    place.start.position.z() += 0.08;
  } while (place.apart(place.start) < 1e-3);
  return place;
}

Place inside_of(Random& random, const Hollow& hollow, int kind) {
  Place place;
  const Shaped tool = random_tool_inside(random, kind);
  place.tool = tool.tool;
  const double friction = random_friction(random);
  for (const auto& shape : hollow.shapes) place.add(shape, friction);
  place.apart = [=](const ToolPose& pose) { return least_depth(tool.inside, pose, hollow.depth); };
  place.outwards = true;
  return place;
}

// A block's surface as a mesh, from outside or inside.
Place at_block(Random& random, Kind kind, bool inside) {
  Place place;
  const std::vector<Body> parts = random_parts(random, kind);
  place.tool = tool_of(parts);
  Body block;
  block.size = inside ? Vec3(0.2, 0.25, 0.3) : random_size(random, 0.04, 0.1);
  place.add(std::make_shared<const TriangleFeatures>(std::make_shared<const TriangleMesh>(tests::block(block.size))),
            random_friction(random));
  place.objects.back().inside_out = inside;
  place.outwards = inside;
  place.apart = [=](const ToolPose& pose) {
    double gap = 1.0;
    for (const Body& part : parts) {
      if (!inside) gap = std::min(gap, apart(at(part, isometry(pose)), block));
      if (inside) {
        for (const Vec3& corner : corners_of(part)) {
          gap = std::min(gap, (0.5 * block.size - (pose * corner).cwiseAbs()).minCoeff() - part.radius);
        }
      }
    }
    return gap;
  };
  place.start = somewhere(random, inside ? 0.02 : 0.15, place);
  return place;
}

// Boxes, or a hull, on a body as a scan has it, or in it.
Place at_rough_body(Random& random, int kind, bool inside) {
  Place place;
  std::vector<Polyhedron> bodies;
  if (kind == 0) {
    const ConvexTool hull = random_hull(random);
    place.tool.parts = {{hull, Pose::Identity(), {}}};
    bodies.push_back(polyhedron_of_hull(hull.points_m));
  }
  for (int i = 0; i < kind; ++i) {
    Body part;
    part.size = random_size(random, 0.01, 0.03);
    part.X = random_pose(random, i == 0 ? 0.0 : 0.02);
    place.tool.parts.push_back({shape_of(part), part.X, {}});
    bodies.push_back(polyhedron_of_box(part.size, part.X));
  }
  Vec3 middle = Vec3::Zero();
  for (const Vec3& x : bodies[0].corners) middle += x / static_cast<double>(bodies[0].corners.size());
  const auto mesh = rough_ball(random, inside ? 0.12 : 0.06, 8);
  place.add(std::make_shared<const TriangleFeatures>(mesh), random_friction(random));
  place.objects.back().inside_out = inside;
  place.outwards = inside;
  std::vector<Polyhedron> triangles;
  for (std::uint32_t f = 0; f < mesh->size(); ++f) triangles.push_back(polyhedron_of(*mesh, f));
  place.apart = [=](const ToolPose& pose) {
    if (mesh->encloses(pose * middle) != inside) return -1.0;
    std::vector<Polyhedron> here;
    for (const Polyhedron& body : bodies) here.push_back(at(body, pose));
    return polyhedra_from_mesh(here, triangles);
  };
  place.start = somewhere(random, inside ? 0.02 : 0.15, place);
  return place;
}

TEST(StiffnessIndependence, OfASphereAmongSolids) {
  expect_independent("sphere", 10'000'000, [](Random& random) { return among_solids(random, Kind::sphere); });
}
TEST(StiffnessIndependence, OfACapsuleAmongSolids) {
  expect_independent("capsule", 11'000'000, [](Random& random) { return among_solids(random, Kind::capsule); });
}
TEST(StiffnessIndependence, OfABoxAmongSolids) {
  expect_independent("box", 12'000'000, [](Random& random) { return among_solids(random, Kind::box); });
}
TEST(StiffnessIndependence, OfACompoundAmongSolids) {
  expect_independent("compound", 13'000'000, [](Random& random) { return among_solids(random, Kind::compound); });
}
TEST(StiffnessIndependence, OfAHullAmongBoxes) { expect_independent("hull", 14'000'000, hull_among_boxes); }
TEST(StiffnessIndependence, OfToolsOnPlanes) {
  expect_independent("planes", 15'000'000, [](Random& random) { return on_planes(random, random.below(5)); });
}
TEST(StiffnessIndependence, OfToolsInHollowObjects) {
  expect_independent("hollow", 16'000'000, [](Random& random) {
    const std::array<Hollow, 4> hollows = {hollow_sphere(0.04), hollow_capsule(0.05, 0.03), hollow_cylinder(0.07, 0.03),
                                           hollow_box({0.05, 0.06, 0.07})};
    const int in = random.below(4);
    // A cylinder in a hollow capsule is refused by compile_rigid().
    return inside_of(random, hollows[static_cast<std::size_t>(in)], random.below(in == 1 ? 3 : 4));
  });
}
TEST(StiffnessIndependence, OfToolsOnABlockThatIsAMesh) {
  expect_independent("block", 17'000'000, [](Random& random) {
    const auto kind = static_cast<Kind>(random.below(4));
    return at_block(random, kind, random.chance(0.5));
  });
}
TEST(StiffnessIndependence, OfToolsOnARoughBody) {
  expect_independent("rough", 18'000'000, [](Random& random) {
    const int kind = random.below(3);
    return at_rough_body(random, kind, random.chance(0.3));
  });
}

}  // namespace
}  // namespace proxarm::models

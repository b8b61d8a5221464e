// Limits may put the proxy into an object. It comes out on the side on which it went in: also out of a mesh, whose
// faces hold a proxy on both sides, so that the mesh alone would keep it inside.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "controller/rendering/rendered_world.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

// The proxy starts at the origin, 0.2 mm in front of a face that is at right angles to x.
constexpr double face_m = 2e-4;
constexpr double rounding_m = 1e-9;  // the face's lift of a mesh, and positions in its box of 0.1 m

struct World {
  explicit World(const std::string& object)
      : scene(scenes::compile(scenes::parse_scene("objects:\n  - " + object, source_file("scenes/gave_way.yaml")))),
        world(make_rendered_world(scene, SessionSettings{}, 4.0)) {
    world->start(Vec3::Zero());
    free();  // the first step settles the start
  }
  // A step that limits take to `way_m` from the last place, and nowhere else.
  WorldStep forced(const Vec3& way_m) {
    StepLimits limits;
    limits.hard_count = 1;
    limits.hard[0] = {way_m, 1e-7, Limit::acceleration};
    limits.q_k1_W = q;
    return taken(world->step(Vec3::Zero(), limits));
  }
  WorldStep free(const Vec3& h_W = Vec3::Zero()) { return taken(world->step(h_W, {})); }
  WorldStep taken(const WorldStep& step) {
    EXPECT_EQ(step.fault, ProxyFault::none);
    q = step.q_W;
    return step;
  }

  scenes::CompiledScene scene;
  std::unique_ptr<RenderedWorld> world;
  Vec3 q = Vec3::Zero();
};

const std::string box = "box: {name: block, centre_m: [0.0502, 0, 0], size_m: [0.1, 0.1, 0.1], friction: 0.3}\n";
// The same block as a mesh of twelve triangles.
const std::string mesh = "mesh: {name: block, file: " + source_file("tests/controller/rendering/block.obj").string() +
                         ", position_m: [0.0502, 0, 0], friction: 0.3}\n";

TEST(GaveWay, AProxyThatLimitsPutIntoAnObjectComesOutWhereItWentIn) {
  for (const std::string& object : {box, mesh}) {
    World world(object);
    for (int k = 0; k < 5; ++k) world.forced({1e-3, 0.0, 0.0});
    ASSERT_GT(world.q.x(), face_m + 4e-3) << object;
    const WorldStep out = world.free();
    EXPECT_LT(world.q.x(), face_m + rounding_m) << object;
    EXPECT_LT(out.f_W.x(), 0.0) << "the object pushes it back";
    for (int k = 0; k < 50; ++k) world.free({20.0, 0.0, 0.0});
    EXPECT_LT(world.q.x(), face_m + rounding_m) << object;
  }
}

TEST(GaveWay, AProxyThatTheArmTakesIntoAnObjectComesOutWhereItWentIn) {
  for (const std::string& object : {box, mesh}) {
    World world(object);
    for (int k = 1; k <= 5; ++k) world.world->resume({1e-3 * k, 0.0, 0.0}, Vec3::Zero());
    for (int k = 0; k < 5; ++k) world.free();
    EXPECT_LT(world.q.x(), face_m + rounding_m) << object;
  }
}

// A block that comes at 0.1 m/s, or goes; in each cycle the arm takes the proxy on into the block.
TEST(GaveWay, AMovingMeshKeepsTheProxyOnItsSideWhereverTheArmTakesIt) {
  constexpr double T = 1e-3;
  for (const bool in_honey : {false, true})
    for (const double speed_m_per_s : {-0.1, 0.1}) {
      std::string moving = mesh;
      moving.insert(moving.rfind('}'), ", motion: {velocity_m_per_s: [" + std::to_string(speed_m_per_s) + ", 0, 0]}");
      World world(moving + (in_honey ? "media:\n  - viscous: {damping_Ns_per_m: 5}\n" : ""));
      int steps = 1;
      for (int k = 0; k < 200; ++k, ++steps) {
        world.free({20.0, 0.0, 0.0});
        world.q = world.world->resume(world.q + Vec3(3e-4, 2e-5, 0.0), Vec3(speed_m_per_s, 0.0, 0.0));
      }
      for (int k = 0; k < 3; ++k, ++steps) world.free();
      EXPECT_LT(world.q.x(), face_m + speed_m_per_s * T * steps + rounding_m)
          << speed_m_per_s << " m/s" << (in_honey ? ", in honey" : "");
    }
}

TEST(GaveWay, ARecordsStateKnowsTheSide) {
  World world(mesh), other(mesh);
  for (int k = 0; k < 3; ++k) world.forced({1e-3, 0.0, 0.0});
  std::vector<std::byte> bytes(1 << 16);
  auto written = fieldbus::StateArchive::writer(bytes);
  world.world->archive(written);
  auto read = fieldbus::StateArchive::reader(bytes);
  other.world->archive(read);
  for (int k = 0; k < 5; ++k) ASSERT_EQ(world.free().q_W, other.free().q_W) << k;
  EXPECT_LT(other.q.x(), face_m + rounding_m);
}

TEST(GaveWay, AProxyInACavityStaysInTheCavity) {
  World world("mesh: {name: room, file: " + source_file("tests/controller/rendering/block.obj").string() +
              ", position_m: [0, 0, 0]}\n");
  for (int k = 0; k < 400; ++k) world.free({20.0, 5.0, 0.0});
  EXPECT_LT(world.q.x(), 0.05);
  for (int k = 0; k < 3; ++k) world.forced({1e-3, 0.0, 0.0});
  ASSERT_GT(world.q.x(), 0.05);
  for (int k = 0; k < 5; ++k) world.free();
  EXPECT_LT(world.q.x(), 0.05 + rounding_m);
}

}  // namespace
}  // namespace proxarm::controller

// Scene files: what is refused, and where the message points.
#include <gtest/gtest.h>

#include <string>

#include "models/base/setup_error.hpp"
#include "scenes/format/scene_file.hpp"

namespace proxarm::tests {
namespace {

using scenes::parse_scene;

TEST(SceneFile, NamesEveryMistakeWithItsPlace) {
  const auto problem = [](const std::string& text) {
    try {
      parse_scene(text, "scene.yaml");
    } catch (const description::SetupError& error) {
      EXPECT_EQ(error.file(), "scene.yaml") << error.what();
      EXPECT_GT(error.line(), 0) << error.what();
      return std::string(error.what());
    }
    ADD_FAILURE() << "accepted: " << text;
    return std::string();
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text << "\n  lacks: " << part;
  };
  has(problem("objects:\n  - plane: {point_m: [0, 0, 0], normal: [0, 0, 0]}\n"), "normal");
  has(problem("objects:\n  - plane: {point_m: [0, 0], normal: [0, 0, 1]}\n"), "point_m");
  has(problem("objects:\n  - plane: {point_m: [0, 0, 0], normal: [0, 0, 1], friction: -0.1}\n"), "friction");
  has(problem("objects:\n  - plane: {point_m: [0, 0, 0], normal: [0, 0, 1], frictoin: 0.1}\n"), "friction");
  has(problem("objects:\n  - plan: {point_m: [0, 0, 0], normal: [0, 0, 1]}\n"), "plane");
  has(problem("objects:\n  - {}\n"), "plane");
  has(problem("objects:\n  - 3\n"), "plane");
  has(problem("objects:\n  - sphere: {centre_m: [0, 0, 0], radius_m: 0}\n"), "radius_m");
  has(problem("objects:\n  - box: {centre_m: [0, 0, 0], size_m: [1, -1, 1]}\n"), "size_m");
  has(problem("objects:\n  - cylinder: {from_m: [0, 0, 0], to_m: [0, 0, 0], radius_m: 1}\n"), "to_m");
  has(problem("objects:\n  - sphere: {centre_m: [0, 0, 0], radius_m: 1, motion: {swing: {amplitude_m: [1, 0, 0]}}}\n"),
      "frequency_Hz");
  has(problem("guide: {polyline: {points_m: [[0, 0, 0], [0, 0, 0]]}}\n"), "another point");
  has(problem("guide: {circle: {}}\n"), "circle");
  has(problem("media:\n  - viscous: {damping_Ns_per_m: -1}\n"), "damping_Ns_per_m");
  has(problem("coulomb_field: {force_N: 0}\n"), "force_N");
  has(problem("dimensions: 4\n"), "dimensions");
  has(problem("dimensions: 2\n"), "space");
  has(problem("dimensions: 2\nspace: {axes: [[1, 0, 0]]}\n"), "axes");
  has(problem("dimensions: 2\nspace: {axes: [[1, 0, 0], [1, 1, 0]]}\n"), "right angles");
  has(problem("objects:\n  - plane: {name: a, point_m: [0, 0, 0], normal: [0, 0, 1]}\n"
              "  - plane: {name: a, point_m: [0, 0, 0], normal: [0, 0, 1]}\n"),
      "name");
}

}  // namespace
}  // namespace proxarm::tests

// Which layers of a scene are pressed on alone and at once, for the judge of stability.
#include "scenes/compiler/layer_touches.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace proxarm::scenes {
namespace {

using models::Vec3;

Object layered(std::string name, Shape shape, double stiffness_N_per_m = 2000.0) {
  Object object;
  object.name = std::move(name);
  object.shape = std::move(shape);
  object.layer = ElasticLayer{.thickness_m = 0.01, .stiffness_N_per_m = stiffness_N_per_m};
  return object;
}

std::size_t of_size(const std::vector<LayersTogether>& touches, std::size_t size) {
  std::size_t count = 0;
  for (const LayersTogether& touch : touches) count += touch.size() == size ? 1 : 0;
  return count;
}

const PlaneShape floor_plane{Vec3::Zero(), Vec3(0.0, 0.0, 3.0)}, wall{Vec3(1.0, 0.0, 0.0), Vec3(-2.0, 0.0, 0.0)};

TEST(LayerTouches, NoneWithoutALayer) {
  Scene scene;
  EXPECT_TRUE(layer_touches(scene).empty());
  scene.objects = {layered("hard", wall)};
  scene.objects[0].layer.reset();
  EXPECT_TRUE(layer_touches(scene).empty());
}

TEST(LayerTouches, AFaceHasItsNormalAndWhatIsRoundHasSeven) {
  Scene scene;
  scene.objects = {layered("wall", wall)};
  ASSERT_EQ(layer_touches(scene).size(), 1u);
  EXPECT_NEAR(layer_touches(scene)[0][0].normal_W.x(), -1.0, 1e-15);
  scene.objects = {layered("box", BoxShape{})};
  EXPECT_EQ(layer_touches(scene).size(), 3u);
  for (const Shape& shape : {Shape(SphereShape{}), Shape(CapsuleShape{}), Shape(CylinderShape{})}) {
    scene.objects = {layered("round", shape)};
    EXPECT_EQ(layer_touches(scene).size(), 7u);
  }
}

TEST(LayerTouches, WhatMeetsIsPressedOnAtOnce) {
  Scene scene;
  scene.objects = {layered("floor", floor_plane), layered("wall", wall)};
  EXPECT_EQ(of_size(layer_touches(scene), 2), 1u);
  // Stacked: both are pressed on where the lower one is.
  scene.objects = {layered("upper", floor_plane), layered("lower", PlaneShape{Vec3(0.0, 0.0, -0.005), Vec3::UnitZ()})};
  EXPECT_EQ(of_size(layer_touches(scene), 2), 1u);
  // The two walls of a corridor never are.
  scene.objects = {layered("wall", wall), layered("other", PlaneShape{Vec3(-1.0, 0.0, 0.0), Vec3::UnitX()})};
  EXPECT_EQ(of_size(layer_touches(scene), 2), 0u);
  scene.objects = {layered("ball", SphereShape{Vec3::Zero(), 0.1}), layered("far", SphereShape{Vec3::UnitX(), 0.1})};
  EXPECT_EQ(of_size(layer_touches(scene), 2), 0u);
  scene.objects[1].motion = Motion{.velocity_m_per_s = Vec3::UnitX()};
  EXPECT_EQ(of_size(layer_touches(scene), 2), 7u);
}

TEST(LayerTouches, ACavityIsPressedOnInItsEdgesAndCorners) {
  Scene scene;
  scene.objects = {layered("cavity", BoxShape{.inside_out = true})};
  const auto touches = layer_touches(scene);
  EXPECT_EQ(of_size(touches, 1), 3u);
  EXPECT_EQ(of_size(touches, 2), 3u);
  EXPECT_EQ(of_size(touches, 3), 1u);
}

TEST(LayerTouches, StayInTheScenesSpace) {
  Scene scene;
  scene.space.dimensions = 1;
  scene.objects = {layered("floor", floor_plane), layered("ball", SphereShape{})};
  const auto touches = layer_touches(scene);
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_EQ(touches[0][0].object, "ball");
  EXPECT_NEAR(std::abs(touches[0][0].normal_W.x()), 1.0, 1e-15);
}

TEST(LayerTouches, AreBoundedInNumberAndKeepTheStiffest) {
  Scene scene;
  for (int i = 0; i < 200; ++i) {
    scene.objects.push_back(
        layered(std::to_string(i), PlaneShape{Vec3::Zero(), Vec3(1.0, 0.01 * i, 1.0)}, 1000.0 + 10.0 * i));
  }
  const auto touches = layer_touches(scene);
  ASSERT_EQ(touches.size(), most_touches);
  EXPECT_EQ(touches[0][0].object, "199");
}

}  // namespace
}  // namespace proxarm::scenes

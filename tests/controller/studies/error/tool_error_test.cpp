#include "controller/extras/studies/error/tool_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "controller/extras/studies/error/tool_cases.hpp"

namespace proxarm::studies {
namespace {

using models::Twist;
using models::Vec3;

// What the world exerts on the tool at its centre, by Newton and Euler: M a − F, J α − τ.
Twist reaction(const ToolCase& which, double t) {
  const ToolState at = which.exact(t);
  Twist sum = at.acceleration;
  sum.head<3>() *= which.mass_kg;
  sum.tail<3>() *= which.inertia_kg_m2;
  const models::Wrench hand = which.hand(t);
  sum.head<3>() -= hand.force;
  sum.tail<3>() -= hand.torque;
  return sum;
}

TEST(ToolCases, VelocityAndAccelerationAreTheDerivativesOfThePose) {
  constexpr double h = 1e-4;
  for (const ToolCase& which : tool_cases()) {
    for (double t = 0.013; t < tool_case_s; t += 0.0371) {
      const auto pose = [&](double at) { return which.exact(at).pose; };
      const Twist ahead = models::difference(pose(t + h), pose(t)), behind = models::difference(pose(t), pose(t - h));
      const Twist bend = (ahead - behind) / (h * h) - which.exact(t).acceleration;
      if (bend.norm() > 1e-2 && (which.name == "fall" || which.name == "skid")) continue;  // the event is in between
      EXPECT_LT(((ahead + behind) / (2.0 * h) - which.exact(t).velocity).norm(), 1e-6) << which.name << " at " << t;
      EXPECT_LT(bend.norm(), 1e-2) << which.name << " at " << t;
    }
  }
}

// At the one place that touches: a push, within the cone, whose lever is what turns the tool.
TEST(ToolCases, WhatHoldsTheToolIsAForceAtItsContactThatKeepsCoulombsLaw) {
  const std::map<std::string, double> frictions{{"roll", 0.5}, {"skid", 0.3}, {"tip", 3.0}, {"fall", 3.0}};
  for (const ToolCase& which : tool_cases()) {
    const auto friction = frictions.find(which.name);
    if (friction == frictions.end()) continue;
    for (double t = 0.0; t < 0.25; t += 0.01) {  // (from 0.28 s on what fell is at rest)
      const Twist w = reaction(which, t);
      const Vec3 force = w.head<3>(), centre = which.exact(t).pose.position;
      const bool ball = which.name == "roll" || which.name == "skid";
      const Vec3 lever = (ball ? Vec3(centre.x(), 0.0, 0.0) : Vec3::Zero()) - centre;
      EXPECT_GT(force.z(), 0.0) << which.name;
      EXPECT_LE(std::abs(force.x()), friction->second * force.z() * (1.0 + 1e-12)) << which.name;
      EXPECT_LT((lever.cross(force) - w.tail<3>()).norm(), 1e-12) << which.name << " at " << t;
    }
  }
}

TEST(ToolCases, FloorAndWallPushTheLadderWhereItsEndsAre) {
  for (const ToolCase& which : tool_cases()) {
    if (which.name != "ladder") continue;
    for (double t = 0.0; t < tool_case_s; t += 0.02) {
      const Twist w = reaction(which, t);
      const Vec3 c = which.exact(t).pose.position;
      EXPECT_GT(w[0], 0.0);  // the wall's
      EXPECT_GT(w[2], 0.0);  // the floor's
      // The ends are twice as far from the corner as the middle.
      const Vec3 on_floor(2.0 * (c.x() - 0.01) + 0.01, 0.0, 0.01), on_wall(0.01, 0.0, 2.0 * (c.z() - 0.01) + 0.01);
      const Vec3 torque = (on_floor - c).cross(Vec3(0.0, 0.0, w[2])) + (on_wall - c).cross(Vec3(w[0], 0.0, 0.0));
      EXPECT_LT((torque - w.tail<3>()).norm(), 1e-12) << t;
    }
  }
}

// Of second order where nothing bends, of first where a place goes on a circle, as for a point (error.hpp).
TEST(ToolErrorStudy, ErrorsFallByTheSquareOfTheTimestepAndWhereWaysBendByItself) {
  const ToolErrorStudy study;
  const Options quick{.quick = true};
  Table table(study.columns());
  for (std::size_t job = 0; job < study.jobs(quick); ++job) {
    for (const Row& row : study.run(job, quick)) table.add(job, row);
  }
  const nlohmann::json cases = study.headline(table, quick).at("cases");
  const std::map<std::string, double> orders{{"turn", 2.0}, {"roll", 2.0}, {"skid", 2.0},
                                             {"tip", 1.0},  {"fall", 1.0}, {"ladder", 1.0}};
  ASSERT_EQ(cases.size(), orders.size());
  for (const auto& [name, order] : orders) {
    EXPECT_NEAR(cases.at(name).at("turn_order").get<double>(), order, 0.1) << name;
    EXPECT_EQ(cases.at(name).at("unresolved").get<double>(), 0.0) << name;
    EXPECT_LT(cases.at(name).at("turn_error_at_1_ms_rad").get<double>(), order == 2.0 ? 5e-6 : 5e-4) << name;
  }
}

TEST(ToolErrorStudy, ItsTitleNamesTheMotionThatErrsMost) {
  Table table(ToolErrorStudy().columns());
  const auto add = [&table](const char* name, double period_s, double place_m, double turn_rad) {
    table.add(0, {std::string(name), 1.0, period_s, place_m, place_m, turn_rad, turn_rad, 0.0, 500.0});
  };
  add("tip", 1e-3, 5.6e-6, 4e-4);
  add("ladder", 1e-3, 3.1e-5, 3.1e-4);
  add("ladder", 16e-3, 1.0, 1.0);  // not asked about
  EXPECT_EQ(tool_error_answer(table),
            "At 1 ms a rigid tool is within 31 µm and 0.4 mrad (rms) of its exact motion; worst: a rod slides down "
            "between wall and floor (place), a box tips over its edge (orientation)");
  add("ladder", 1e-3, 3.1e-5, 5e-4);
  EXPECT_EQ(tool_error_answer(table),
            "At 1 ms a rigid tool is within 31 µm and 0.5 mrad (rms) of its exact motion; worst: a rod slides down "
            "between wall and floor");
}

}  // namespace
}  // namespace proxarm::studies

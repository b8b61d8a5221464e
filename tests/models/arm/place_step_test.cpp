#include "models/arm/place_step.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "models/base/random.hpp"

namespace proxarm::models {
namespace {

struct Asked {
  Jacobian J;
  Vec<6> e;
  StepRoom room;
};

// Joints that may move by 1 to 3 mrad a step, brake from up to half of that, and ease by up to as much.
Asked random_case(Random& random, Eigen::Index axes) {
  Asked out;
  out.J.resize(6, axes);
  for (Eigen::Index i = 0; i < axes; ++i) out.J.col(i) << random.in_box(0.8), random.direction();
  out.room.most_rad = out.room.brakes_rad = JointVector(axes);
  for (Eigen::Index i = 0; i < axes; ++i) {
    out.room.most_rad[i] = random.uniform(1e-3, 3e-3);
    out.room.brakes_rad[i] = random.uniform(-0.5, 0.5) * out.room.most_rad[i];
  }
  out.room.high_rad = out.room.most_rad;
  out.room.low_rad = -out.room.most_rad;
  out.room.eased_high_rad = out.room.brakes_rad + 0.5 * out.room.most_rad;
  out.room.eased_low_rad = out.room.brakes_rad - 0.5 * out.room.most_rad;
  return out;
}

// A tool's step that some joint step makes, `times` as far as is comfortable.
void ask_for(Asked& out, Random& random, double times) {
  JointVector d = out.room.brakes_rad;
  for (Eigen::Index i = 0; i < d.size(); ++i) d[i] += times * random.uniform(-0.4, 0.4) * out.room.most_rad[i];
  out.e = out.J * d;
}

TEST(PlaceStep, WhatJointsCanTurnTheyTurnExactly) {
  Random random(1);
  int exactly = 0;
  for (int k = 0; k < 2000; ++k) {
    Asked asked = random_case(random, 6);
    ask_for(asked, random, 0.3);
    JointVector step = JointVector::Zero(6);
    if (!place_step(asked.J, asked.e, asked.room, step)) continue;  // the place alone may ask for more than there is
    const JointVector exact = asked.J.fullPivLu().solve(asked.e);
    if (!asked.room.allows(exact)) continue;
    // λ² goes down to 8⁻⁴⁰ of J's size; normal equations round by the square of its condition, in the joints' units.
    const Eigen::VectorXd sizes = (asked.J * asked.room.most_rad.asDiagonal()).jacobiSvd().singularValues();
    const double condition = sizes[0] / sizes[5];
    EXPECT_LT((asked.J * step - asked.e).norm(), 1e-15 * condition * condition * asked.e.norm() + 1e-18) << k;
    ++exactly;
  }
  EXPECT_GT(exactly, 500);
}

TEST(PlaceStep, KeepsThePlaceAndAllBoundsAndTurnsLessWhereTheyDontAllowMore) {
  Random random(2);
  int gave_way = 0;
  for (int k = 0; k < 5000; ++k) {
    const Eigen::Index axes = random.chance(0.5) ? 6 : 7;
    Asked asked = random_case(random, axes);
    ask_for(asked, random, 1.0);
    asked.e.tail<3>() *= random.log_uniform(1.0, 100.0);
    JointVector step = JointVector::Zero(axes);
    if (!place_step(asked.J, asked.e, asked.room, step)) continue;
    ASSERT_TRUE((step.array() <= asked.room.high_rad.array()).all() &&
                (step.array() >= asked.room.low_rad.array()).all());
    const Vec<6> left = asked.J * step - asked.e;
    ASSERT_LT(left.head<3>().norm(), 1e-12 + 1e-9 * asked.e.head<3>().norm()) << k;
    if (left.tail<3>().norm() < 1e-6 * asked.e.tail<3>().norm()) continue;
    ++gave_way;
    // At a bound, or eased out of one that the place needs: else it would turn further.
    const JointVector slack = 1e-4 * asked.room.most_rad;
    const auto at = [&](const JointVector& bound) {
      return ((step - bound).cwiseAbs().array() <= slack.array()).any();
    };
    ASSERT_TRUE(at(asked.room.high_rad) || at(asked.room.low_rad) || at(asked.room.eased_high_rad) ||
                at(asked.room.eased_low_rad) || !asked.room.allows(step))
        << k;
  }
  EXPECT_GT(gave_way, 1000);
}

// A wrist whose first and last axes are one turns no further about what they can't, and as asked about the rest.
TEST(PlaceStep, WhereADirectionIsLostItTurnsAboutTheOthers) {
  Asked asked;
  asked.J = Jacobian::Zero(6, 6);
  asked.J.topLeftCorner<3, 3>().setIdentity();
  asked.J(3, 3) = asked.J(4, 4) = asked.J(3, 5) = 1.0;
  asked.room = {.brakes_rad = JointVector::Zero(6),
                .most_rad = JointVector::Constant(6, 0.01),
                .low_rad = JointVector::Constant(6, -0.01),
                .high_rad = JointVector::Constant(6, 0.01),
                .eased_low_rad = JointVector::Constant(6, -0.01),
                .eased_high_rad = JointVector::Constant(6, 0.01)};
  asked.e << 1e-3, 2e-3, -1e-3, 1e-3, -2e-3, 3e-3;
  JointVector step = JointVector::Zero(6);
  ASSERT_TRUE(place_step(asked.J, asked.e, asked.room, step));
  Vec<6> expected = asked.e;
  expected[5] = 0.0;
  EXPECT_LT((asked.J * step - expected).norm(), 1e-12);
}

TEST(PlaceStep, WhereThePlaceAsksForTooMuchOrIsLostNothingChanges) {
  Random random(3);
  Asked far = random_case(random, 6);
  far.e << Vec3::Constant(1.0), Vec3::Zero();
  const JointVector before = JointVector::Constant(6, 0.125);
  JointVector step = before;
  EXPECT_FALSE(place_step(far.J, far.e, far.room, step));
  EXPECT_EQ(step, before);
  Asked stretched = random_case(random, 6);
  stretched.J.row(0).setZero();
  ask_for(stretched, random, 0.1);
  EXPECT_FALSE(place_step(stretched.J, stretched.e, stretched.room, step));
  EXPECT_EQ(step, before);
}

}  // namespace
}  // namespace proxarm::models

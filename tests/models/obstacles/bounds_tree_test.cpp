// BoundsTree against a look at every box.
#include "models/obstacles/bounds_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::tests {
namespace {

using models::Bounds;
using models::BoundsTree;
using models::Vec3;

double distance(const Bounds& b, const Vec3& x) { return (b.low - x).cwiseMax(x - b.high).cwiseMax(0.0).norm(); }

// The leaves' indices aren't their places in the list, so that a mix-up of the two shows.
std::size_t index_of(std::size_t place) { return 7 * place + 3; }

BoundsTree tree_of(const std::vector<Bounds>& boxes) {
  std::vector<BoundsTree::Leaf> leaves;
  for (std::size_t i = 0; i < boxes.size(); ++i) leaves.push_back({boxes[i], index_of(i)});
  return BoundsTree(std::move(leaves));
}

std::vector<std::size_t> found_within(const BoundsTree& tree, const Vec3& x, double radius) {
  std::vector<std::size_t> found;
  tree.within(x, radius, [&](std::size_t i) { found.push_back(i); });
  std::sort(found.begin(), found.end());  // the order is the tree's own
  return found;
}

// Asks for the radius given, and for those that end a rounding before and after a box.
void expect_within_as_brute_force(const BoundsTree& tree, const std::vector<Bounds>& boxes, const Vec3& x,
                                  double radius) {
  std::vector<std::size_t> surely, perhaps;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double d = distance(boxes[i], x), rounding = 1e-15 * (d + radius);
    if (d <= radius - rounding) surely.push_back(index_of(i));
    if (d <= radius + rounding) perhaps.push_back(index_of(i));
  }
  const std::vector<std::size_t> found = found_within(tree, x, radius);
  ASSERT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end()) << "visited twice";
  ASSERT_TRUE(std::includes(found.begin(), found.end(), surely.begin(), surely.end()))
      << "missed one of " << boxes.size();
  ASSERT_TRUE(std::includes(perhaps.begin(), perhaps.end(), found.begin(), found.end())) << "found one too many";
}

// An object within a box is farther than the box or as far: here by a share of the box's own size.
double object_distance(const std::vector<Bounds>& boxes, std::size_t index, const Vec3& x) {
  const std::size_t i = (index - 3) / 7;
  return distance(boxes[i], x) + 0.1 * static_cast<double>(i % 5) * (boxes[i].high - boxes[i].low).norm();
}

void expect_nearest_as_brute_force(const BoundsTree& tree, const std::vector<Bounds>& boxes, const Vec3& x,
                                   double most) {
  double expected = most;
  for (std::size_t i = 0; i < boxes.size(); ++i) expected = std::min(expected, object_distance(boxes, index_of(i), x));
  ASSERT_EQ(tree.nearest(x, most, [&](std::size_t i) { return object_distance(boxes, i, x); }), expected);
}

void expect_as_brute_force(const std::vector<Bounds>& boxes, Random& random, double reach, int questions) {
  const BoundsTree tree = tree_of(boxes);
  for (int k = 0; k < questions; ++k) {
    const Vec3 x = random.in_box<3>(reach);
    ASSERT_NO_FATAL_FAILURE(expect_within_as_brute_force(tree, boxes, x, random.log_uniform(1e-6, 2.0) * reach));
    ASSERT_NO_FATAL_FAILURE(expect_nearest_as_brute_force(tree, boxes, x, std::numeric_limits<double>::infinity()));
    ASSERT_NO_FATAL_FAILURE(expect_nearest_as_brute_force(tree, boxes, x, random.log_uniform(1e-6, 2.0) * reach));
  }
}

Bounds box_at(const Vec3& centre, const Vec3& half) { return {centre - half, centre + half}; }

TEST(BoundsTree, OfNothingFindsNothing) {
  for (const BoundsTree& tree : {BoundsTree(), BoundsTree(std::vector<BoundsTree::Leaf>{})}) {
    EXPECT_TRUE(found_within(tree, Vec3::Zero(), 1e9).empty());
    EXPECT_EQ(tree.nearest(Vec3::Zero(), 5.0, [](std::size_t) { return 0.0; }), 5.0);
  }
}

TEST(BoundsTree, OfOneObjectIsItsBox) {
  const std::vector<Bounds> one{box_at({1, 2, 3}, {0.1, 0.2, 0.3})};
  const BoundsTree tree = tree_of(one);
  EXPECT_EQ(found_within(tree, {1, 2, 3}, 0.0), std::vector<std::size_t>{3}) << "inside";
  EXPECT_EQ(found_within(tree, {1.1, 2.2, 3.3}, 0.0), std::vector<std::size_t>{3}) << "its corner";
  EXPECT_EQ(found_within(tree, {1, 2, 3.8}, 0.5), std::vector<std::size_t>{3}) << "exactly at the margin";
  EXPECT_TRUE(found_within(tree, {1, 2, 3.8}, 0.4999).empty());
  Random random(611);
  expect_as_brute_force(one, random, 4.0, 1000);
}

TEST(BoundsTree, FindsWhatBruteForceFindsAmongAFew) {
  Random random(612);
  for (std::int64_t i = 0; i < scaled(2000); ++i) {
    std::vector<Bounds> boxes(static_cast<std::size_t>(1 + random.below(12)));
    for (Bounds& box : boxes) box = box_at(random.in_box<3>(1.0), random.log_uniform(1e-4, 1.0) * Vec3::Ones());
    ASSERT_NO_FATAL_FAILURE(expect_as_brute_force(boxes, random, 2.0, 5)) << "world " << i;
  }
}

TEST(BoundsTree, FindsWhatBruteForceFindsAmongThousands) {
  Random random(613);
  std::vector<Bounds> boxes(10'000);
  for (Bounds& box : boxes) box = box_at(random.in_box<3>(1.0), 0.02 * random.in_box<3>(1.0).cwiseAbs());
  expect_as_brute_force(boxes, random, 1.5, static_cast<int>(scaled(200)));
}

// Points, lines and plates; many at the same place, in a row, or around each other: whatever gives halving nothing to
// halve by.
TEST(BoundsTree, FindsWhatBruteForceFindsAmongDegenerateBoxes) {
  Random random(614);
  const auto flattened = [&random](Vec3 half) {
    for (double& x : half) x = random.chance(0.5) ? 0.0 : x;
    return half;
  };
  std::vector<Bounds> flat, same, row, nested;
  for (int i = 0; i < 500; ++i) {
    flat.push_back(box_at(random.in_box<3>(1.0), flattened(random.in_box<3>(0.3).cwiseAbs())));
    same.push_back(box_at({0.1, 0.2, 0.3}, Vec3::Zero()));
    row.push_back(box_at({0.01 * i - 2.5, 0, 0}, Vec3::Zero()));
    nested.push_back(box_at(Vec3::Zero(), std::pow(0.95, i) * Vec3::Ones()));
  }
  for (const auto& boxes : {flat, same, row, nested}) expect_as_brute_force(boxes, random, 2.0, 300);
}

// As World asks: a ball about the proxy that moves and grows in small steps, and what was found must hold everything
// that a smaller ball within it meets.
TEST(BoundsTree, KeepsAllWithinAMovingMargin) {
  Random random(615);
  std::vector<Bounds> boxes(2000);
  for (Bounds& box : boxes) box = box_at(random.in_box<3>(1.0), 0.05 * random.in_box<3>(1.0).cwiseAbs());
  const BoundsTree tree = tree_of(boxes);
  Vec3 x = Vec3::Zero(), centre = x;
  std::vector<std::size_t> near;
  double margin = -1.0;
  std::int64_t asked = 0;
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    x += random.log_uniform(1e-6, 1e-2) * random.direction<3>() - 1e-3 * x;
    const double radius = random.log_uniform(1e-6, 1e-2);
    if (!((x - centre).norm() + radius <= margin)) {
      margin = 2.0 * radius + 1e-2;
      centre = x;
      near = found_within(tree, centre, margin);
      ++asked;
      ASSERT_NO_FATAL_FAILURE(expect_within_as_brute_force(tree, boxes, centre, margin));
    }
    const std::vector<std::size_t> met = found_within(tree, x, radius * (1.0 - 1e-12));
    ASSERT_TRUE(std::includes(near.begin(), near.end(), met.begin(), met.end())) << "step " << i;
  }
  EXPECT_LT(asked, scaled(20'000));
}

}  // namespace
}  // namespace proxarm::tests

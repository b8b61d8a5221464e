#include "controller/signals/point_contacts.hpp"

#include <gtest/gtest.h>

#include <random>

namespace proxarm::controller {
namespace {

using models::Vec3;

CycleRecord touching(const std::vector<std::pair<Vec3, double>>& normals_and_friction, const Vec3& f) {
  CycleRecord record;
  record.proxy_W_m = {0.1, 0.2, 0.3};
  record.contact_force_W_N = triple(f);
  record.contact_count = static_cast<std::uint8_t>(normals_and_friction.size());
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    record.contacts[i].normal_W = triple(normals_and_friction[i].first);
    record.contacts[i].friction = normals_and_friction[i].second;
  }
  return record;
}

Vec3 sum_of_forces(const CycleRecord& record) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) sum += vec3(record.contacts[i].force_W_N);
  return sum;
}

TEST(PointContacts, OneBearsAllOfTheForceAtTheProxy) {
  CycleRecord record = touching({{Vec3::UnitZ(), 0.3}}, {1.0, 2.0, 30.0});
  place_contacts(record);
  EXPECT_EQ(record.contacts[0].force_W_N, record.contact_force_W_N);
  EXPECT_EQ(record.contacts[0].point_W_m, record.proxy_W_m);
}

TEST(PointContacts, NothingIsSaidWhereNothingPresses) {
  CycleRecord record = touching({}, {1.0, 2.0, 3.0});
  place_contacts(record);
  for (const RecordedContact& contact : record.contacts) EXPECT_EQ(contact.force_W_N, Triple{});
}

TEST(PointContacts, WithoutFrictionEachBearsItsOwnNormalForce) {
  // A corner of three walls that aren't at right angles: 3, 5 and 7 N along their normals is the only answer.
  const Vec3 a = Vec3::UnitX(), b = Vec3(0.4, 1.0, 0.0).normalized(), c = Vec3(0.3, -0.2, 1.0).normalized();
  CycleRecord record = touching({{a, 0.0}, {b, 0.0}, {c, 0.0}}, 3.0 * a + 5.0 * b + 7.0 * c);
  place_contacts(record);
  // 200 sweeps of Gauss-Seidel at these angles leave rounding.
  EXPECT_LT((vec3(record.contacts[0].force_W_N) - 3.0 * a).norm(), 1e-12);
  EXPECT_LT((vec3(record.contacts[1].force_W_N) - 5.0 * b).norm(), 1e-12);
  EXPECT_LT((vec3(record.contacts[2].force_W_N) - 7.0 * c).norm(), 1e-12);
}

TEST(PointContacts, FrictionIsSharedByNormalForceTimesFriction) {
  CycleRecord record = touching({{Vec3::UnitX(), 0.2}, {Vec3::UnitY(), 0.4}}, {10.0, 5.0, 1.0});
  place_contacts(record);
  // 10 N at 0.2 and 5 N at 0.4 bear the same: half of 1 N along z each.
  EXPECT_LT((vec3(record.contacts[0].force_W_N) - Vec3(10.0, 0.0, 0.5)).norm(), 1e-12);
  EXPECT_LT((vec3(record.contacts[1].force_W_N) - Vec3(0.0, 5.0, 0.5)).norm(), 1e-12);
}

// Any contacts, also more than are recorded, of the same normal, opposed ones, and forces that none of them explains.
TEST(PointContacts, ForcesAddUpAndNoNormalPullsWhateverPresses) {
  std::mt19937_64 generator(46);
  std::printf("seed 46\n");
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<std::size_t> count(1, 12);
  for (int run = 0; run < 2000; ++run) {
    std::vector<std::pair<Vec3, double>> contacts(count(generator));
    for (auto& [n, friction] : contacts) {
      n = Vec3(normal(generator), normal(generator), normal(generator)).normalized();
      friction = run % 3 == 0 ? 0.0 : std::abs(normal(generator));
    }
    if (run % 5 == 0) contacts.back().first = contacts.front().first;
    if (run % 7 == 0) contacts.back().first = -contacts.front().first;
    const Vec3 f = 100.0 * Vec3(normal(generator), normal(generator), normal(generator));
    CycleRecord record = touching(contacts, f);
    place_contacts(record);
    ASSERT_LT((sum_of_forces(record) - f).norm(), 1e-11 * f.norm()) << run;  // eight roundings of as many terms
    for (const RecordedContact& contact : record.contacts) {
      ASSERT_TRUE(vec3(contact.force_W_N).allFinite());
    }
  }
}

}  // namespace
}  // namespace proxarm::controller

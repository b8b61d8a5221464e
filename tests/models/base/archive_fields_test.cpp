#include "models/base/archive_fields.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::fieldbus {
namespace {

using models::Vec3;

struct Inner {
  double a = 0.0;
  std::uint32_t b = 0;
};
enum class Letter : std::uint8_t { alpha, beta };
struct Outer {
  Vec3 q_W = Vec3::Zero();
  Inner inner;
  std::array<std::uint64_t, 3> counts{};
  bool flag = false;
  Letter letter = Letter::alpha;
  models::Wrench wrench;
};
static_assert(field_count<Inner> == 2);
static_assert(field_count<Outer> == 6);
static_assert(field_count<models::Wrench> == 2);

struct Longer {
  Vec3 q_W = Vec3::Zero();
  Inner inner;
  std::array<std::uint64_t, 3> counts{};
  bool flag = false;
  Letter letter = Letter::alpha;
  models::Wrench wrench;
  bool one_more = false;
};
static_assert(field_count<Longer> == 7, "a member that is added is counted");

struct Sixteen {
  double a = 1, b = 2, c = 3, d = 4, e = 5, f = 6, g = 7, h = 8, i = 9, j = 10, k = 11, l = 12, m = 13, n = 14, o = 15,
         p = 16;
};

std::vector<std::byte> written(auto& object) {
  std::vector<std::byte> bytes(1024);
  StateArchive archive = StateArchive::writer(bytes);
  archive_fields(archive, object);
  EXPECT_TRUE(archive.whole());
  bytes.resize(archive.bytes());
  return bytes;
}

TEST(ArchiveFields, ComeBackAsTheyWere) {
  Outer then{.q_W = Vec3(1.0, 2.0, 3.0),
             .inner = {.a = 4.0, .b = 5},
             .counts = {6, 7, 8},
             .flag = true,
             .letter = Letter::beta,
             .wrench = {Vec3(9.0, 10.0, 11.0), Vec3(12.0, 13.0, 14.0)}};
  const std::vector<std::byte> bytes = written(then);
  EXPECT_EQ(bytes.size(), 24u + 8 + 4 + 24 + 1 + 1 + 48) << "without padding";
  Outer now;
  StateArchive archive = StateArchive::reader(bytes);
  archive_fields(archive, now);
  EXPECT_TRUE(archive.whole());
  EXPECT_EQ(now.q_W, then.q_W);
  EXPECT_EQ(now.inner.a, 4.0);
  EXPECT_EQ(now.inner.b, 5u);
  EXPECT_EQ(now.counts, then.counts);
  EXPECT_TRUE(now.flag);
  EXPECT_EQ(now.letter, Letter::beta);
  EXPECT_EQ(now.wrench.torque, then.wrench.torque);
}

TEST(ArchiveFields, AreVisitedInTheOrderOfTheirDeclaration) {
  Sixteen sixteen;
  double next = 1.0;
  for_each_field(sixteen, [&](double& member) { EXPECT_EQ(member, next++); });
  EXPECT_EQ(next, 17.0);
}

}  // namespace
}  // namespace proxarm::fieldbus

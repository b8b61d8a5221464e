#include "controller/extras/studies/skip.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace proxarm::studies {
namespace {

class SkipAnswer : public testing::Test {
 protected:
  void add(const char* kind, double count, double free_ns, double contact_ns) {
    const double none = std::nan("");
    table.add(job++, {std::string(kind), std::string(kind), count, free_ns, 0.9 * free_ns, contact_ns, 50.0, 1.0, none,
                      none, none, none});
  }

  std::size_t job = 0;
  Table table{Skip(CycleRun{}).columns()};
};

TEST_F(SkipAnswer, IsOfTheLargestWorlds) {
  add("objects", 1.0, 19.6, 249.0);
  add("objects", 10000.0, 19.6, 319.0);
  add("triangles", 80.0, 18.7, 565.0);
  add("triangles", 99224.0, 18.7, 338.0);
  EXPECT_EQ(skip_answer(table),
            "How large the world is hardly matters: a step takes 20 ns free and 319 ns in contact among 10,000 "
            "spheres, 19 and 338 ns among 99,224 triangles");
}

TEST_F(SkipAnswer, DoesNotSayThatSizeHardlyMattersWhereItDoes) {
  add("objects", 1.0, 20.0, 250.0);
  add("objects", 100.0, 20.0, 900.0);
  add("triangles", 80.0, 19.0, 300.0);
  EXPECT_EQ(skip_answer(table),
            "A step takes 20 ns free and 900 ns in contact among 100 spheres, 19 and 300 ns among 80 triangles");
}

TEST_F(SkipAnswer, ClaimsNothingWithoutData) { EXPECT_EQ(skip_answer(table), "What a step costs"); }

}  // namespace
}  // namespace proxarm::studies

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "controller/record/black_box.hpp"

namespace proxarm::controller {
namespace {

TEST(MappedBox, HasWhatTheCycleWrites) {
  BlackBox box(1e-3, 4, BlackBox::Memory::by_descriptor);
  const MappedBox mapped(box.descriptor());
  EXPECT_EQ(mapped.cycles(), 0U);
  for (int k = 0; k < 12000; ++k) {
    BoxCycle& entry = box.begin(1000 * k);
    entry.record.cycle = static_cast<std::uint64_t>(k);
    entry.rendered_ns = k;
    BoxFrame frame;
    frame.time_ns = 7 * k;
    box.add(frame);
    box.finish();
  }
  EXPECT_EQ(mapped.cycles(), 12000U);
  EXPECT_EQ(mapped.oldest_cycle(), box.oldest_cycle());
  BoxCycle cycle;
  EXPECT_FALSE(mapped.read(500, cycle));  // overwritten
  EXPECT_FALSE(mapped.read(12000, cycle));
  std::vector<BoxFrame> frames;
  ASSERT_TRUE(mapped.read(11999, cycle, frames));
  EXPECT_EQ(cycle.record.cycle, 11999U);
  EXPECT_EQ(cycle.rendered_ns, 11999);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].time_ns, 7 * 11999);
}

// Told beside the cycle, so it comes a little later than the cycle itself, or never.
TEST(MappedBox, HasTheTruthOfASimulatedTool) {
  BlackBox box(1e-3, 4, BlackBox::Memory::by_descriptor);
  const MappedBox mapped(box.descriptor());
  box.add_truth({1.0, 2.0, 3.0}, {0.0, 0.0, 0.0, 1.0});  // of no cycle
  BoxTruth truth;
  EXPECT_EQ(mapped.truths(), 0U);
  for (int k = 0; k < 12000; ++k) {
    (void)box.begin(1000 * k);
    box.finish();
    if (k != 11998) box.add_truth({1e-3 * k, 0.0, 0.0}, {0.0, 0.6, 0.0, 0.8});
    EXPECT_FALSE(mapped.truth(static_cast<std::uint64_t>(k) + 1, truth));
  }
  EXPECT_EQ(mapped.truths(), 12000U);
  ASSERT_TRUE(mapped.truth(11999, truth));
  EXPECT_EQ(truth.tool_m, (Triple{11.999, 0.0, 0.0}));
  EXPECT_EQ(truth.tool_q, (std::array<double, 4>{0.0, 0.6, 0.0, 0.8}));
  EXPECT_FALSE(mapped.truth(11998, truth));  // left out
  EXPECT_FALSE(mapped.truth(500, truth));    // overwritten
}

TEST(MappedBox, IsNoneOfAnotherKind) {
  EXPECT_THROW(MappedBox(-1), std::runtime_error);
  const int other = memfd_create("other", MFD_CLOEXEC);
  EXPECT_THROW(MappedBox{other}, std::runtime_error);
  ASSERT_EQ(ftruncate(other, 100'000), 0);
  EXPECT_THROW(MappedBox{other}, std::runtime_error);
  close(other);
}

TEST(BlackBox, HasNoDescriptorUnlessItIsAskedFor) { EXPECT_EQ(BlackBox(1e-3, 4).descriptor(), -1); }

}  // namespace
}  // namespace proxarm::controller

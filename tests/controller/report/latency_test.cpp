// Latencies: quantiles of a histogram against sorted numbers, and what is taken of a cycle's frames.
#include "controller/report/latency.hpp"

#include <gtest/gtest.h>

#include <random>

namespace proxarm::controller {
namespace {

TEST(Latency, QuantilesAreThoseOfTheSortedTimesToAMicrosecond) {
  std::mt19937_64 random(1);
  std::exponential_distribution<double> time_us(1.0 / 20.0);
  std::vector<double> times;
  LatencyHistogram histogram;
  for (int i = 0; i < 100000; ++i) {
    times.push_back(time_us(random));
    histogram.add(static_cast<std::int64_t>(1e3 * times.back()));
  }
  std::sort(times.begin(), times.end());
  for (const double share : {0.5, 0.99, 0.999}) {
    const double exact = times[static_cast<std::size_t>(share * 100000.0) - 1];
    EXPECT_GE(histogram.quantile_us(share), exact - 1e-3);
    EXPECT_LE(histogram.quantile_us(share), exact + 1.0) << "a bin is a microsecond wide";
  }
  EXPECT_NEAR(histogram.max_us(), times.back(), 1e-3);
  EXPECT_EQ(histogram.count(), 100000u);
}

TEST(Latency, OfWhatIsLaterThanTheBinsTheLargestIsKnown) {
  LatencyHistogram histogram;
  histogram.add(12'345'678);
  histogram.add(-5);
  EXPECT_DOUBLE_EQ(histogram.quantile_us(1.0), 12345.678);
  EXPECT_EQ(histogram.counts()[0], 1u);
}

// Beyond 4 ms, all were in one bin, and the median of a late session was its latest cycle.
TEST(Latency, LateCyclesHaveQuantilesToo) {
  for (const double exact_us : {4095.0, 4096.0, 4351.5, 4352.0, 8191.9, 8192.0, 150e3, 3e9}) {
    LatencyHistogram histogram;
    for (int i = 0; i < 3; ++i) histogram.add(static_cast<std::int64_t>(1e3 * exact_us));
    histogram.add(3'500'000'000'000);
    EXPECT_GE(histogram.quantile_us(0.5), exact_us);
    EXPECT_LE(histogram.quantile_us(0.5), (1.0 + 1.0 / 16.0) * exact_us + 1.0);
  }
  LatencyHistogram days;
  days.add(std::int64_t{1} << 62);
  EXPECT_EQ(days.quantile_us(0.5), days.max_us());
}

TEST(Latency, OfACycleIsTakenFromItsFrames) {
  BlackBox box(1e-3, 20);
  LatencyMeter meter(box, 2, {0x680, 0x681});
  const auto frame = [&](std::uint32_t id, std::uint8_t bus, bool sent, std::int64_t time_ns) {
    fieldbus::CanFrame f;
    f.id = id;
    box.add({f, time_ns, bus, sent});
  };
  constexpr std::int64_t t_k_ns = 5'000'000;
  BoxCycle& cycle = box.begin(t_k_ns);
  cycle.record.compute_ns = 7'400;
  cycle.record.set(RecordFlag::sample_held, false);
  frame(0x080, 0, true, t_k_ns + 12'300);
  frame(0x080, 1, true, t_k_ns + 15'000);
  frame(0x680, 2, true, t_k_ns + 20'000);
  frame(0x181, 0, false, t_k_ns + 200'000);
  frame(0x680, 2, false, t_k_ns + 250'000);
  frame(0x681, 2, false, t_k_ns + 300'000);
  frame(0x681, 0, false, t_k_ns + 330'000);  // on another bus
  frame(0x201, 0, true, t_k_ns + 340'000);
  frame(0x206, 1, true, t_k_ns + 355'600);
  frame(0x77F, 1, true, t_k_ns + 390'000);  // a heartbeat
  box.finish();
  meter.drain();
  meter.drain();
  EXPECT_EQ(meter.latencies().wake_up.count(), 1u);
  EXPECT_DOUBLE_EQ(meter.latencies().wake_up.max_us(), 12.3);
  EXPECT_DOUBLE_EQ(meter.latencies().compute.max_us(), 7.4);
  EXPECT_DOUBLE_EQ(meter.latencies().sensor_to_setpoint.max_us(), 55.6);
}

}  // namespace
}  // namespace proxarm::controller

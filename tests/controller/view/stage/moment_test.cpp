#include "controller/stage/moment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "controller/stage/words.hpp"

namespace proxarm::view {
namespace {

double number_at(const std::string& bytes, std::size_t index) {
  double number = 0.0;
  std::memcpy(&number, bytes.data() + 8 * index, sizeof number);
  return number;
}

std::size_t place_of(const std::string& field) {
  const auto& names = field_names();
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), field) - names.begin());
}

TEST(Moment, IsOnTheWireWhereItsNamesSay) {
  Moment moment;
  moment.record.time_ns = 2'500'000'000;
  moment.record.proxy_W_m = {0.1, 0.2, 0.3};
  moment.record.flags = 1u << 25;
  moment.record.proxy_mass_kg = 3.75;
  moment.record.proxy_inertia_kg_m2 = 0.03;
  moment.record.contact_torque_W_Nm = {0.0, 0.0, -0.5};
  moment.handle_mass_kg = 0.25;
  models::Pose X = models::Pose::Identity();
  X.translation() = models::Vec3(1, 2, 3);
  moment.record.contact_count = 1;
  moment.record.contacts[0] = {.object = 2, .gap_m = -1e-6};
  moment.record.contacts[0].point_W_m = {0.4, 0.5, 0.6};
  const std::string bytes = encode_moment(moment, std::vector{X, X}, std::vector{X});
  const std::size_t contacts = 1 + field_names().size(), fields = contact_field_names().size();
  const std::size_t poses = contacts + 1 + fields;
  ASSERT_EQ(bytes.size(), 8 * poses + 4 * 7 * 3);
  EXPECT_EQ(number_at(bytes, contacts), 1.0);
  EXPECT_EQ(number_at(bytes, contacts + 1), 2.0);
  EXPECT_EQ(number_at(bytes, contacts + 5), -1e-6);
  EXPECT_EQ(number_at(bytes, contacts + 7), 0.5);
  EXPECT_EQ(number_at(bytes, 0), kind_moment);
  EXPECT_EQ(number_at(bytes, 1 + place_of("time_s")), 2.5);
  EXPECT_EQ(number_at(bytes, 1 + place_of("proxy_y")), 0.2);
  EXPECT_EQ(number_at(bytes, 1 + place_of("flags")), 33554432.0);
  EXPECT_EQ(number_at(bytes, 1 + place_of("mass_kg")), 4.0);
  EXPECT_EQ(number_at(bytes, 1 + place_of("inertia_kg_m2")), 0.03);
  EXPECT_EQ(number_at(bytes, 1 + place_of("contact_torque_z")), -0.5);
  std::array<float, 7> pose{};
  std::memcpy(pose.data(), bytes.data() + 8 * poses, sizeof pose);
  EXPECT_EQ(pose, (std::array<float, 7>{1, 2, 3, 0, 0, 0, 1}));
}

TEST(Moment, KeepsThePeaksOfAllCyclesSinceTheLast) {
  MomentBuilder builder(0.0);
  EXPECT_TRUE(builder.empty());
  controller::CycleRecord record;
  for (const double force : {1.0, 9.0, 2.0}) {
    record.force_W_N = {0.0, force, 0.0};
    record.compute_ns = static_cast<std::int64_t>(1000 * force);
    record.set(controller::RecordFlag::limit_speed, force > 8.0);
    record.set(controller::RecordFlag::overrun, force > 8.0);
    builder.add(record, 0.0);
  }
  Moment moment = builder.take();
  EXPECT_EQ(moment.hand_peak_N, 9.0);
  EXPECT_EQ(moment.compute_peak_us, 9.0);
  EXPECT_EQ(moment.record.force_W_N[1], 2.0);
  EXPECT_NE(moment.flags_since & static_cast<std::uint32_t>(controller::RecordFlag::limit_speed), 0U);
  EXPECT_EQ(moment.overruns, 1U);
  builder.add(record, 0.0);
  moment = builder.take();
  EXPECT_EQ(moment.hand_peak_N, 2.0);
  EXPECT_EQ(moment.flags_since & static_cast<std::uint32_t>(controller::RecordFlag::limit_speed), 0U);
  EXPECT_EQ(moment.overruns, 1U);  // of the whole session
}

TEST(Moment, SaysWhereToolAndSteelAreBesideEachContact) {
  Moment moment;
  controller::CycleRecord& record = moment.record;
  record.proxy_W_m = {0.5, 0.0, 0.5};
  record.tool_W_m = {0.5, 0.0, 0.5 - 2e-5};
  record.proxy_inertia_kg_m2 = 0.05;
  record.contact_count = 1;
  record.contacts[0].point_W_m = {0.6, 0.0, 0.5};
  moment.tool_q = Eigen::AngleAxisd(1e-3, models::Vec3::UnitY());  // its far end goes down
  const std::string bytes = encode_moment(moment, {}, {});
  const std::size_t tool = 1 + field_names().size() + 1 + 14;
  EXPECT_EQ(contact_field_names()[14], "tool_x");
  EXPECT_NEAR(number_at(bytes, tool + 2), -2e-5 - 1e-4, 1e-9);
  EXPECT_TRUE(std::isnan(number_at(bytes, tool + 5)));
  record.true_tool_W_m = {0.5, 0.0, 0.5 - 3e-5};
  EXPECT_NEAR(number_at(encode_moment(moment, {}, {}), tool + 5), -3e-5, 1e-12);
  record.proxy_inertia_kg_m2 = 0.0;  // a tool that is held has the proxy's orientation
  EXPECT_NEAR(number_at(encode_moment(moment, {}, {}), tool + 2), -2e-5, 1e-12);
}

// A proxy of 3.75 kg at 36 mm/s is stopped in a step of 1 ms, by 135 N; then the hand pushes with 2 N.
TEST(Blow, IsTheImpulseOfATouchWhateverTheTimestep) {
  for (const std::int64_t period_ns : {250'000, 1'000'000, 4'000'000}) {
    Blow blow;
    controller::CycleRecord record;
    record.period_ns = period_ns;
    EXPECT_TRUE(std::isnan(blow.impulse_Ns()) && std::isnan(blow.begun_s()));
    for (int k = 0; k < 1000; ++k) {
      record.time_ns = k * period_ns;
      record.force_W_N = {0.0, 0.0, -2.0};
      record.contact = k < 10 ? controller::ContactPhase::free : controller::ContactPhase::stick;
      const double T = 1e-9 * static_cast<double>(period_ns);
      record.contact_force_W_N = {0.0, 0.0, k < 10 ? 0.0 : k == 10 ? 2.0 + 3.75 * 0.036 / T : 2.0};
      blow.add(record);
    }
    EXPECT_NEAR(blow.impulse_Ns(), 3.75 * 0.036, 1e-9);
    EXPECT_NEAR(blow.begun_s(), 10e-9 * static_cast<double>(period_ns), 1e-12);
  }
}

TEST(Moment, AHistorySaysHowManyRowsItHas) {
  std::vector<double> rows;
  append_fields(rows, {});
  append_fields(rows, {});
  const std::string bytes = encode_history(rows);
  EXPECT_EQ(number_at(bytes, 0), kind_history);
  EXPECT_EQ(number_at(bytes, 1), 2.0);
  EXPECT_EQ(bytes.size(), 8 * (2 + 2 * field_names().size()));
}

TEST(Words, ThereAreSomeForEveryFlagAndPhase) {
  for (std::uint32_t bit = 0; bit <= 26; ++bit) {
    if (bit == 9 || bit == 23) continue;  // `truth`: not of the session; 23 is free
    EXPECT_EQ(std::count_if(flag_words().begin(), flag_words().end(),
                            [&](const FlagWords& f) { return static_cast<std::uint32_t>(f.flag) == 1u << bit; }),
              1)
        << bit;
  }
  for (std::size_t i = 0; i < controller::phase_count; ++i) {
    EXPECT_STRNE(phase_words(static_cast<controller::Phase>(i)).words, "?");
  }
}

TEST(Words, AFaultHasItsPlaceAndFigures) {
  description::Cell cell;
  cell.drives.resize(3);
  cell.drives[2].joint = "axis_3";
  controller::CycleRecord record;
  EXPECT_EQ(fault_text(record, cell), "");
  record.fault = controller::Fault::drive_silent;
  record.fault_where = 2;
  record.fault_value = 4.0;
  record.fault_limit = 3.0;
  record.fault_cycle = 77;
  const std::string text = fault_text(record, cell);
  EXPECT_NE(text.find("drive_silent (drive of axis_3)"), std::string::npos) << text;
  EXPECT_NE(text.find("4 cycles, limit 3"), std::string::npos) << text;
  EXPECT_NE(text.find("cycle 77"), std::string::npos) << text;
}

}  // namespace
}  // namespace proxarm::view

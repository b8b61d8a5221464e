// What PoseWorld tells of a tool's contacts: the strongest of them, wherever 𝒢 has them.
#include <gtest/gtest.h>

#include <random>

#include "controller/motion/motion.hpp"
#include "controller/rendering/pose_world.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::PoseContact;
using models::Vec3;

// Touches at places that a test says.
class Touching final : public models::PoseAlgorithm {
 public:
  explicit Touching(const std::vector<PoseContact>& contacts) : contacts_(contacts) {}
  const models::ToolPose& step(const models::Mat6& /*K*/, const models::ToolPose& p_hat,
                               const models::ToolPose& /*q*/) noexcept override {
    return q_ = p_hat;
  }
  [[nodiscard]] std::span<const PoseContact> contacts() const noexcept override { return contacts_; }
  [[nodiscard]] double clearance_m(const models::ToolPose& /*pose*/) const noexcept override { return 0.0; }
  [[nodiscard]] std::unique_ptr<models::PoseAlgorithm> clone() const override {
    return std::make_unique<Touching>(contacts_);
  }
  void copy_state(const models::PoseAlgorithm& /*other*/) noexcept override {}

 private:
  const std::vector<PoseContact>& contacts_;
  models::ToolPose q_;
};

CycleRecord record_of(const std::vector<PoseContact>& contacts) {
  scenes::CompiledScene scene = scenes::compile(scenes::load_scene(source_file("scenes/wall.yaml")));
  PoseWorldConfig config;
  config.proxy.mass_kg = 4.0;
  config.proxy.inertia_kg_m2 = 0.05;
  config.proxy.period_s = 1e-3;
  PoseWorld world(std::make_unique<Touching>(contacts), scene, config);
  world.start(Vec3::Zero());
  CycleRecord record;
  record_world(world.step(Vec3::Zero(), {}), record);
  return record;
}

TEST(PoseWorldContacts, TheStrongestComeFirstAndTheWeakestAreLeftOut) {
  std::mt19937_64 generator(8);
  std::printf("seed 8\n");
  std::uniform_real_distribution<double> size(0.0, 50.0);
  for (std::size_t count = 0; count <= 20; ++count) {
    std::vector<PoseContact> contacts(count);
    std::vector<double> pressing;
    for (std::size_t i = 0; i < count; ++i) {
      contacts[i].object = static_cast<std::int32_t>(i);
      contacts[i].point_W = Vec3::Constant(static_cast<double>(i));
      if (i % 4 == 3) continue;  // it touches, and doesn't press
      pressing.push_back(size(generator));
      contacts[i].force_W = pressing.back() * Vec3(0.6, 0.0, 0.8);
    }
    const CycleRecord record = record_of(contacts);
    std::sort(pressing.rbegin(), pressing.rend());
    ASSERT_EQ(record.contact_count, pressing.size());
    ASSERT_EQ(record.recorded_contacts(), std::min<std::size_t>(8, pressing.size()));
    for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
      const RecordedContact& contact = record.contacts[i];
      EXPECT_DOUBLE_EQ(vec3(contact.force_W_N).norm(), pressing[i]);
      EXPECT_EQ(vec3(contact.point_W_m), Vec3::Constant(contact.object)) << "place and object of the same contact";
    }
  }
}

TEST(PoseWorldContacts, OfEqualForcesTheFirstStaysFirst) {
  std::vector<PoseContact> contacts(3);
  for (std::size_t i = 0; i < 3; ++i) {
    contacts[i].object = static_cast<std::int32_t>(i);
    contacts[i].force_W = Vec3(0.0, 0.0, 10.0);
  }
  const CycleRecord record = record_of(contacts);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(record.contacts[i].object, static_cast<std::int32_t>(i));
}

}  // namespace
}  // namespace proxarm::controller

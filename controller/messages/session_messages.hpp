// A session as JSON messages for other tools. Poses, transforms and the scene have Foxglove's schemas; forces,
// contacts, joints and the session's state have our own schemas.
//
//   /tool, /proxy      foxglove.PoseInFrame       poses in W
//   /wrench            proxarm.Wrench             the hand's, in W
//   /contact           proxarm.Contact            the world's force on the proxy, normal, friction, distances
//   /contacts          proxarm.Contacts           each contact: place, normal, force, torque, object, part, gap
//   /contact_arrows    foxglove.SceneUpdate       the contacts' forces at their places
//   /joint_states      proxarm.JointStates        commanded and measured
//   /session           proxarm.Session            phase, limits, fault, mass
//   /tf                foxglove.FrameTransforms   the arm's links in W
//   /scene             foxglove.SceneUpdate       arm and scene; once, and when objects move
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "controller/stage/stage.hpp"

namespace proxarm::view {

enum class Topic : std::uint8_t {
  tool,
  proxy,
  wrench,
  contact,
  joint_states,
  session,
  transforms,
  scene,
  contacts,
  contact_arrows
};
inline constexpr std::size_t topic_count = static_cast<std::size_t>(Topic::contact_arrows) + 1;

struct TopicDescription {
  const char* topic;
  const char* schema;
  std::string json_schema;
};
[[nodiscard]] const TopicDescription& describe(Topic topic);

class SessionMessages {
 public:
  // Precondition: `stage` outlives this object.
  explicit SessionMessages(const Stage& stage) : stage_(stage) {}

  // Returns a topic's message about a moment. `links` and `objects` are as from Stage::place().
  [[nodiscard]] std::string message(Topic topic, const Moment& moment, std::span<const models::Pose> links,
                                    std::span<const models::Pose> objects) const;

 private:
  const Stage& stage_;
};

}  // namespace proxarm::view

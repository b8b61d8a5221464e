#include "models/rigid/rigid_world.hpp"

#include <utility>

#include "models/rigid/clearance.hpp"
#include "models/rigid/rigid_step.hpp"

namespace proxarm::models {

RigidWorld::RigidWorld(const Tool& tool, std::vector<RigidObject> objects)
    : state_(std::make_unique<RigidState>(std::make_shared<RigidSetup>(rigid_setup(tool, std::move(objects))))) {}

RigidWorld::RigidWorld(const RigidWorld& other)
    : PoseAlgorithm(other), state_(std::make_unique<RigidState>(*other.state_)) {}

RigidWorld& RigidWorld::operator=(const RigidWorld& other) noexcept {
  *state_ = *other.state_;
  return *this;
}

RigidWorld::~RigidWorld() = default;

std::unique_ptr<PoseAlgorithm> RigidWorld::clone() const { return std::make_unique<RigidWorld>(*this); }

void RigidWorld::copy_state(const PoseAlgorithm& other) noexcept { *this = dynamic_cast<const RigidWorld&>(other); }

const ToolPose& RigidWorld::step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept {
  RigidStep(*state_).take(K, p_hat, q);
  state_->bodies.arrive();
  return state_->q;
}

void RigidWorld::set_time(const StepTime& time) noexcept { state_->bodies.set_time(time); }

bool RigidWorld::wants_time() const noexcept { return !state_->bodies.moving().empty(); }

void RigidWorld::set_friction(std::int32_t object, double friction) noexcept {
  state_->bodies.set_friction(object, friction);
}

void RigidWorld::drive(std::int32_t object, const Pose& X) noexcept { state_->bodies.drive(object, X); }

std::span<const PoseContact> RigidWorld::contacts() const noexcept { return state_->contacts.all(); }

bool RigidWorld::unresolved() const noexcept { return state_->unresolved; }

bool RigidWorld::squeezed() const noexcept { return state_->squeezed; }

double RigidWorld::clearance_m(const ToolPose& pose) const noexcept {
  RigidState copy(*state_);
  copy.bodies.take_all_as_close();
  return least_gap_m(copy, pose);
}

double RigidWorld::clearance_at_m(const ToolPose& pose, double time_s) const noexcept {
  RigidState copy(*state_);
  copy.bodies.go_to_time(time_s);
  return least_gap_m(copy, pose);
}

}  // namespace proxarm::models

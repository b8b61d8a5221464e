// What a step ended on: its contacts, and whether their work is what a step may give.
#include <algorithm>
#include <cmath>
#include <limits>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// A millinewton over a nanometre.
constexpr double kNothing_J = 1e-12;

}  // namespace

// Whether the contacts' work since q(k−1), or another pose, is above 0 by more than what is of second order in the
// step: the way of a point that turns by θ at a lever bends by θ² lever/2, a normal turns by θ while the point goes on
// by s, and something round falls off by s²/2r. That is so of solutions on another side than the one that the tool came
// to: of a face, say, which it was below and beside. An object that moves does honest work, too: with it only what the
// tool moves relative to it counts.
bool RigidWorld::gives_energy_at(const ToolPose& pose, const ToolPose& q_old) noexcept {
  if (!collected_) collect_contacts(pose);
  if (count_ == 0) return false;
  const View now = view(pose), old = view(q_old);
  double work = 0.0, bends = 0.0;
  const double turned_W = rotation_vector(pose.orientation * q_old.orientation.conjugate()).norm();
  const double rounding = 2.0 * rounding_m(pose);  // of a way, between two poses
  see_slip(pose, q_old);
  for (std::size_t k = 0; k < count_; ++k) {
    const PoseContact& contact = contacts_[k];
    const double force = contact.force_W.norm();
    if (force == 0.0) continue;
    const std::uint16_t entry = of_contact_[k];
    const Vec3 way = goes(entry) ? slip_on(entry, contact.point_W - pose.position)
                                 : Vec3(contact.point_W - old * now.to_T(contact.point_W));
    const double s = way.norm(), lever = (contact.point_W - pose.position).norm();
    const double turned = goes(entry) ? moving(entry).turned.norm() : turned_W;
    work += contact.force_W.dot(way);
    bends += force * (turned * (0.5 * turned * lever + turns_[k] * s) + 0.5 * bend_[k] * s * s + rounding);
  }
  return work > bends + kNothing_J;
}

double RigidWorld::bend_per_m(const Pair& pair) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const Solid* other = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape);
  double bend = own.radius > 0.0 ? 1.0 / own.radius : 0.0;
  if (other != nullptr && other->radius > 0.0) bend += 1.0 / other->radius;
  if (pair.kind >= Kind::side_point) {
    for (const auto* cylinder : {&shared_->parts[pair.part].cylinder, &shared_->entries[pair.entry].cylinder}) {
      if (*cylinder) bend += 1.0 / (*cylinder)->radius;
    }
  }
  return bend;
}

// Of the angle γ at which a rim crosses a rim or an edge; 1: the contact is of others. Where a point of one goes across
// the other by s, the place of contact goes along by up to s/sin γ, on circles that bend: their gap bends by up to (1/r
// + 1/r')/sin² γ. Their normal is across both, and turns by up to θ/sin γ where one turns by θ.
double RigidWorld::sine_of_rims(const Found& found, const ToolPose& pose) const noexcept {
  const Pair& pair = pairs_[found.pair];
  if (pair.kind != Kind::rims && pair.kind != Kind::rim_edge) return 1.0;
  const Vec3& n = found.touch.normal;
  const std::optional<Cylinder>&own = shared_->parts[pair.part].cylinder,
        &other = shared_->entries[pair.entry].cylinder;
  const auto along = [](const EdgeLine& edge) { return Vec3(edge.to - edge.from); };
  const auto in_W = [&](const Vec3& of_object) {
    return moves(pair.entry) ? Vec3(moving(pair.entry).mover.at().R * of_object) : of_object;
  };
  const Vec3 along_own =
      own ? Vec3((pose.orientation * own->axis).cross(n)) : Vec3(pose.orientation * along(own_edge(pair)));
  const Vec3 along_other = other ? Vec3(in_W(other->axis).cross(n)) : in_W(along(other_edge(pair)));
  const double lengths = along_own.norm() * along_other.norm();
  return lengths > kAlong ? std::max(along_own.cross(along_other).norm() / lengths, kAlong) : kAlong;
}

void RigidWorld::collect_contacts(const ToolPose& pose) noexcept {
  count_ = 0;
  collected_ = true;
  rides_ = false;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    const Found& found = found_[of_linear_[k]];
    const Pair& pair = pairs_[found.pair];
    if (linear_[k].state == ContactState::open && found.touch.gap > kGap_m) continue;
    PoseContact& contact = contacts_[count_++];
    contact.object = shared_->entries[pair.entry].object.object;
    contact.part = pair.part;
    contact.feature = static_cast<std::int32_t>(pair.other);
    contact.slips = linear_[k].state == ContactState::slip;
    contact.point_W = found.touch.point;
    contact.normal_W = found.touch.normal;
    contact.force_W = axes_[k] * in_cone(linear_[k].f, linear_[k].mu);
    contact.gap_m = found.touch.gap;
    contact.friction = friction(pair);
    of_contact_[count_ - 1] = pair.entry;
    const double sine = sine_of_rims(found, pose);
    turns_[count_ - 1] = 1.0 / sine;
    bend_[count_ - 1] = bend_per_m(pair) / (sine * sine);
    rides_ = rides_ || goes(pair.entry);
  }
}

void RigidWorld::report(const ToolPose& q_old) noexcept {
  if (!collected_) collect_contacts(q_);
  if (count_ == 0) return;
  const double rounding =
      8.0 * std::numeric_limits<double>::epsilon() * (q_old.position.lpNorm<1>() + shared_->reach + extent_m_);
  if (rides_) return judge_slips(q_old, rounding);
  // What sticks stays, bit for bit.
  if (motion(q_, q_old) > rounding) return;
  q_ = q_old;
  for (std::size_t k = 0; k < count_; ++k) contacts_[k].slips = false;
}

}  // namespace proxarm::models

// One moment of a session for display: named numbers, and poses.
//
// The wire format is in the machine's byte order, little-endian. A moment is
//   double            kind: 1
//   double[fields]    the fields, in the order of field_names()
//   double            number of contacts
//   double[fields]    for each contact, the fields in the order of contact_field_names()
//   float[7 links]    for each of the arm's links in W: x y z and quaternion x y z w
//   float[7 objects]  for each object of the scene, its displacement from its pose in the scene's file
// A history, of moments without contacts and poses, is
//   double            kind: 2
//   double            number of moments
//   double[fields]    for each moment, the fields in the order of field_names()
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/record/black_box.hpp"
#include "controller/stage/blow.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::view {

inline constexpr double kind_moment = 1.0, kind_history = 2.0;

// How far the tool could move from the proxy's pose without turning. The direction is the normal of the strongest
// contact; if nothing is touched, the direction out of the nearest object.
struct Room {
  models::Vec3 normal_W = models::Vec3::Zero();
  double below_m = 0.0;  // distance to the touched or nearest object
  double above_m = 0.0;  // distance to the opposite side, as in a hole; infinite: nothing within most_m
  static constexpr double most_m = 1e-3;
};

// What a page shows: one cycle, and peaks over this cycle and the cycles since the last shown one.
struct Moment {
  controller::CycleRecord record;
  double rendered_s = 0.0;
  // Mass of the tool behind the sensor, which the hand feels in addition to the proxy's mass.
  double handle_mass_kg = 0.0;
  std::uint32_t flags_since = 0;  // all RecordFlags since the last moment
  double compute_peak_us = 0.0;   // longest compute time since the last moment
  double hand_peak_N = 0.0;
  double contact_peak_N = 0.0;
  std::uint64_t overruns = 0;                                  // number since the session began
  Blow blow;                                                   // impact of the last touch
  std::optional<Room> room;                                    // absent: nothing is within Room::most_m
  models::Quaternion tool_q = models::Quaternion::Identity();  // orientation of the tool in W, by the encoders
};

class MomentBuilder {
 public:
  explicit MomentBuilder(double handle_mass_kg) noexcept { next_.handle_mass_kg = handle_mass_kg; }
  void add(const controller::CycleRecord& record, double rendered_s) noexcept;
  // Returns the moment of the newest cycle, and restarts the peaks.
  Moment take() noexcept;
  [[nodiscard]] bool empty() const noexcept { return cycles_ == 0; }

 private:
  Moment next_;
  std::uint64_t cycles_ = 0;
};

// Return the names of the fields, in the order of the wire.
[[nodiscard]] const std::vector<std::string>& field_names();
[[nodiscard]] const std::vector<std::string>& contact_field_names();
void append_fields(std::vector<double>& row, const Moment& moment);

std::string encode_moment(const Moment& moment, std::span<const models::Pose> links,
                          std::span<const models::Pose> objects);
// `rows`: the fields of several moments, one moment after the other.
std::string encode_history(std::span<const double> rows);

}  // namespace proxarm::view

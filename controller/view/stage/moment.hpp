// One moment of a session for display: named numbers, and poses.
//
// The wire format, in the machine's byte order, which is little-endian:
//   double            kind: 1, a moment; 2, a history of moments without contacts and poses
//   double[fields]    the fields, in the order of field_names()
//   double            number of contacts
//   double[fields]    of each contact, in the order of contact_field_names()
//   float[7 links]    x y z and quaternion x y z w of each of the arm's links in W
//   float[7 objects]  displacement of each object of the scene from its pose in the scene's file
// A history has after its kind the number of rows, and then the fields of each row.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controller/record/black_box.hpp"
#include "controller/view/stage/blow.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::view {

inline constexpr double kind_moment = 1.0, kind_history = 2.0;

// How far the tool could move from the proxy's pose without turning, along the normal of the strongest contact; if
// nothing is touched, along the way out of the nearest object.
struct Room {
  models::Vec3 normal_W = models::Vec3::Zero();
  double below_m = 0.0;  // to the touched object
  double above_m = 0.0;  // to the opposite side, as in a hole; infinite: nothing within most_m
  static constexpr double most_m = 1e-3;
};

// What a page shows of one cycle, and of the cycles since the last one shown.
struct Moment {
  controller::CycleRecord record;
  double rendered_s = 0.0;
  double handle_mass_kg = 0.0;    // mass of the tool behind the sensor, which the hand feels in addition to the proxy's
  std::uint32_t flags_since = 0;  // all RecordFlags since the last moment
  double compute_peak_us = 0.0;   // longest time of these cycles
  double hand_peak_N = 0.0;
  double contact_peak_N = 0.0;
  std::uint64_t overruns = 0;                                  // since the session began
  Blow blow;                                                   // of the last touch
  std::optional<Room> room;                                    // absent: nothing within Room::most_m
  models::Quaternion tool_q = models::Quaternion::Identity();  // of the tool in W, by the encoders
};

class MomentBuilder {
 public:
  explicit MomentBuilder(double handle_mass_kg) noexcept { next_.handle_mass_kg = handle_mass_kg; }
  void add(const controller::CycleRecord& record, double rendered_s) noexcept;
  // Returns the newest cycle, and restarts the peaks.
  Moment take() noexcept;
  [[nodiscard]] bool empty() const noexcept { return cycles_ == 0; }

 private:
  Moment next_;
  std::uint64_t cycles_ = 0;
};

// The names of the fields in the order of the wire.
[[nodiscard]] const std::vector<std::string>& field_names();
[[nodiscard]] const std::vector<std::string>& contact_field_names();
void append_fields(std::vector<double>& row, const Moment& moment);

std::string encode_moment(const Moment& moment, std::span<const models::Pose> links,
                          std::span<const models::Pose> objects);
// `rows`: fields of several moments, one after the other.
std::string encode_history(std::span<const double> rows);

}  // namespace proxarm::view

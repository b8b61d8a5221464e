#include "controller/extras/proof/proof.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "models/base/random.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::proof {
namespace {

using models::JointVector;
using models::Mat3;
using models::Vec3;

// Share of the tool's weight. A joint is proven by pushes if turning the joint changes the reading by less than this
// share.
constexpr double shown_by_weight = 0.08;
constexpr int poses_tried = 400;

struct Mistake {
  std::string name;
  std::function<JointVector(JointVector)> motors;  // maps the motors' angles by the cell to the motors' true angles
  Mat3 reading = Mat3::Identity();                 // maps the true force to the sensor's reading of it
};

Mat3 turned(double angle_rad, const Vec3& axis) { return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix(); }

void add_joint_mistakes(const description::Cell& cell, std::vector<Mistake>& mistakes) {
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const auto scaled = [k](double share) {
      return [k, share](JointVector motor_rad) {
        motor_rad[k] *= share;
        return motor_rad;
      };
    };
    const std::string joint = cell.drives[i].joint;
    mistakes.push_back({joint + " turns the other way: direction", scaled(-1.0)});
    mistakes.push_back({joint + " turns twice as far: gear_ratio or counts_per_motor_revolution", scaled(2.0)});
    mistakes.push_back({joint + " turns half as far: gear_ratio or counts_per_motor_revolution", scaled(0.5)});
  }
}

void add_sensor_mistakes(std::vector<Mistake>& mistakes) {
  using std::numbers::pi;
  const auto same = [](JointVector motor_rad) { return motor_rad; };
  const std::array<std::pair<const char*, Vec3>, 3> axes{
      {{"x", Vec3::UnitX()}, {"y", Vec3::UnitY()}, {"z", Vec3::UnitZ()}}};
  for (const auto& [name, axis] : axes) {
    const std::string about = std::string(" about its ") + name + " axis: sensor.pose_link";
    mistakes.push_back({"the sensor is turned by 180 degrees" + about, same, turned(pi, axis)});
    mistakes.push_back({"the sensor is turned by 90 degrees" + about, same, turned(0.5 * pi, axis)});
    mistakes.push_back({"the sensor is turned by -90 degrees" + about, same, turned(-0.5 * pi, axis)});
  }
  mistakes.push_back({"the sensor reads with the opposite sign", same, -Mat3::Identity()});
  mistakes.push_back(
      {"the sensor reads twice the force, or tool.mass_kg is half of what hangs there", same, 2.0 * Mat3::Identity()});
  mistakes.push_back(
      {"the sensor reads half the force, or tool.mass_kg is twice what hangs there", same, 0.5 * Mat3::Identity()});
}

std::vector<Mistake> all_mistakes(const description::Cell& cell) {
  std::vector<Mistake> mistakes;
  add_joint_mistakes(cell, mistakes);
  add_sensor_mistakes(mistakes);
  return mistakes;
}

// Returns the vector `along_W` in S.
Vec3 in_sensor(const models::Arm& arm, const JointVector& motor_rad, const Vec3& along_W) {
  return arm.sensor_pose(arm.link_from_motor(motor_rad)).linear().transpose() * along_W;
}

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// Returns the reading without a push at the pose where `pushed` was read; nullptr if there is none.
const Reading* without_push(const std::vector<Reading>& readings, const Reading& pushed) {
  const Reading* found = nullptr;
  for (const Reading& other : readings) {
    if (other.station.push_W.isZero() && other.station.motor_rad == pushed.station.motor_rad) found = &other;
  }
  return found;
}

double residual(const models::Arm& arm, const Vec3& weight_W, const std::vector<Reading>& readings,
                const Mistake& mistake) {
  std::vector<Vec3> read, model;
  Vec3 read_mean = Vec3::Zero(), model_mean = Vec3::Zero();
  for (const Reading& reading : readings) {
    if (!reading.station.push_W.isZero()) continue;
    read.push_back(reading.force_S);
    model.push_back(mistake.reading * in_sensor(arm, mistake.motors(reading.motor_rad), weight_W));
    read_mean += read.back();
    model_mean += model.back();
  }
  read_mean /= static_cast<double>(read.size());
  model_mean /= static_cast<double>(model.size());
  double off = 0.0, all = 0.0;
  for (std::size_t k = 0; k < read.size(); ++k) {
    off += (read[k] - read_mean - (model[k] - model_mean)).squaredNorm();
    all += (model[k] - model_mean).squaredNorm();
  }
  return std::sqrt(off / std::max(all, 1e-12));
}

double largest_angle(const models::Arm& arm, const std::vector<Reading>& readings, const Mistake& mistake) {
  double largest = 0.0;
  for (const Reading& reading : readings) {
    if (reading.station.push_W.isZero()) continue;
    const Reading* before = without_push(readings, reading);
    if (before == nullptr) continue;
    const Vec3 model = mistake.reading * in_sensor(arm, mistake.motors(reading.motor_rad), reading.station.push_W);
    largest = std::max(largest, angle_between(reading.force_S - before->force_S, model));
  }
  return largest;
}

Explanation explain(const description::Cell& cell, const models::Arm& arm, const std::vector<Reading>& readings,
                    const Mistake& mistake) {
  const Vec3 weight_W = cell.tool.mass_kg * Vec3(cell.gravity_W_m_per_s2.data());
  return {mistake.name, residual(arm, weight_W, readings, mistake), largest_angle(arm, readings, mistake)};
}

// Returns for each joint how much the weight's direction in S changes if the joint is turned from this pose.
JointVector shown(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad) {
  const Vec3 down_W = Vec3(cell.gravity_W_m_per_s2.data()).normalized();
  const Vec3 here = in_sensor(arm, motor_rad, down_W);
  JointVector changes = JointVector::Zero(motor_rad.size());
  for (Eigen::Index i = 0; i < motor_rad.size(); ++i) {
    JointVector there = motor_rad;
    there[i] += turn_rad;
    changes[i] = (in_sensor(arm, there, down_W) - here).norm();
  }
  return changes;
}

// Returns the pose in which the least visible joint is most visible. Joints that no pose nearby shows are left out.
JointVector best_pose(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad) {
  models::Random random(1);
  std::vector<JointVector> tried{motor_rad};
  for (int n = 0; n < poses_tried; ++n) {
    JointVector q = motor_rad;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const auto& range = cell.drives[static_cast<std::size_t>(i)].range_rad;
      q[i] += random.uniform(-pose_rad, pose_rad);
      q[i] = std::clamp(q[i], std::min(motor_rad[i], range[0] + turn_rad), std::max(motor_rad[i], range[1] - turn_rad));
    }
    tried.push_back(q);
  }
  std::vector<JointVector> changes;
  JointVector most = JointVector::Zero(motor_rad.size());
  for (const JointVector& q : tried) {
    changes.push_back(shown(cell, arm, q));
    most = most.cwiseMax(changes.back());
  }
  std::size_t best = 0;
  double best_least = -1.0;
  for (std::size_t n = 0; n < tried.size(); ++n) {
    double least = 1.0;
    for (Eigen::Index i = 0; i < most.size(); ++i) {
      if (most[i] >= shown_by_weight) least = std::min(least, changes[n][i]);
    }
    if (least <= best_least) continue;
    best_least = least;
    best = n;
  }
  return tried[best];
}

// Returns whether a mistake rivals the cell as it is: the mistake's residual and angle are at most twice as large as
// the cell's. The cell's residual counts as at least the noise, the cell's angle as at least the error of a careful
// hand.
bool rivals(const Explanation& mistake, const Explanation& as_it_is) {
  constexpr double noise = 0.05, careful_rad = 0.07, clearly = 2.0;
  if (!as_it_is.explains()) return true;
  return mistake.residual <= clearly * std::max(noise, as_it_is.residual) &&
         mistake.angle_rad <= clearly * std::max(careful_rad, as_it_is.angle_rad);
}

}  // namespace

void require_provable(const description::Cell& cell, const models::Arm& arm) {
  if (cell.tool.mass_kg <= 0.0) {
    throw description::SetupError({.file = cell.file.string(),
                                   .key = "tool.mass_kg",
                                   .found = description::number_text(cell.tool.mass_kg),
                                   .expected = "above 0: the tool's weight is what the arm is proven by"});
  }
  // A prismatic joint doesn't turn the tool.
  models::ToolKinematics at;
  arm.kinematics(arm.start_rad(), at);
  for (Eigen::Index i = 0; i < arm.axes(); ++i) {
    if (at.J_W.col(i).tail<3>().norm() > 0.5) continue;
    throw description::SetupError({.file = cell.file.string(),
                                   .key = "prove",
                                   .found = "the linear joint " + cell.drives[static_cast<std::size_t>(i)].joint,
                                   .expected = "joints that turn: no force tells how far a linear one goes"});
  }
}

std::vector<Station> plan(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad) {
  require_provable(cell, arm);
  const JointVector pose = best_pose(cell, arm, motor_rad);
  const JointVector changes = shown(cell, arm, pose);
  if (changes.maxCoeff() < shown_by_weight) {
    throw description::SetupError(
        {.file = cell.file.string(),
         .key = "prove",
         .found = "joints that all turn about the vertical",
         .expected = "one at least that turns the tool's weight, by which the rest is judged"});
  }
  std::vector<Station> stations{{pose}, {pose, Vec3::UnitX()}, {pose, Vec3::UnitY()}};
  for (Eigen::Index i = 0; i < pose.size(); ++i) {
    const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(i)];
    const bool by_weight = changes[i] >= shown_by_weight;
    const double turn = by_weight ? turn_rad : 2.0 * turn_rad;
    JointVector there = pose;
    there[i] += pose[i] + turn <= drive.range_rad[1] ? turn : -turn;
    if (there[i] < drive.range_rad[0]) {
      throw description::SetupError({.file = cell.file.string(),
                                     .key = "prove",
                                     .found = drive.joint + " at " + description::rounded_text(pose[i]) + " rad",
                                     .expected = description::rounded_text(turn) + " rad of its range to either side"});
    }
    stations.push_back({there});
    if (!by_weight) stations.push_back({there, Vec3::UnitX()});
  }
  return stations;
}

Verdict judge(const description::Cell& cell, const models::Arm& arm, const std::vector<Reading>& readings) {
  Verdict verdict;
  verdict.as_it_is = explain(cell, arm, readings, {"", [](JointVector motor_rad) { return motor_rad; }});
  for (const Mistake& mistake : all_mistakes(cell)) {
    const Explanation found = explain(cell, arm, readings, mistake);
    if (found.explains() && rivals(found, verdict.as_it_is)) verdict.mistakes.push_back(found);
  }
  const auto badness = [](const Explanation& e) {
    return std::pow(e.residual / most_residual, 2) + std::pow(e.angle_rad / most_angle_rad, 2);
  };
  std::stable_sort(verdict.mistakes.begin(), verdict.mistakes.end(),
                   [&](const Explanation& a, const Explanation& b) { return badness(a) < badness(b); });
  verdict.proven = verdict.as_it_is.explains() && verdict.mistakes.empty();
  return verdict;
}

std::string text(const Verdict& verdict) {
  const auto line = [](const char* format, const std::string& what, const Explanation& e) {
    std::array<char, 240> words{};
    std::snprintf(words.data(), words.size(), format, what.c_str(), 100.0 * e.residual,
                  e.angle_rad * 180.0 / std::numbers::pi);
    return std::string(words.data());
  };
  constexpr const char* figures = "%s: the tool's weight off by %.0f %% of its change, pushes by %.0f degrees\n";
  std::string told = line(figures, "the cell as it is", verdict.as_it_is);
  for (const Explanation& mistake : verdict.mistakes)
    told += line(figures, "explained by: " + mistake.mistake, mistake);
  if (verdict.proven) return told + "PROVEN: signs, ratios, and the sensor's mounting, sign and scale\n";
  told += "NOT PROVEN";
  if (verdict.as_it_is.explains()) return told + ": the cell explains it, but so would what stands above\n";
  return told + (verdict.mistakes.empty() ? ": no single mistake explains what was read\n" : "\n");
}

}  // namespace proxarm::proof

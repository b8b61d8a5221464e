#include "controller/extras/new_cell/new_cell.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include "controller/extras/new_cell/arm_source.hpp"
#include "controller/extras/new_cell/cell_text.hpp"
#include "controller/extras/new_cell/drive_rules.hpp"
#include "controller/extras/new_cell/start_pose.hpp"
#include "controller/extras/trials/mass_advice.hpp"
#include "controller/extras/trials/trial.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/session_loops.hpp"
#include "controller/preparation/start_check.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::SetupError;

// Distance of the wall from the start. The default cell's hand leads the tool onto a wall at this distance.
constexpr double wall_ahead_m = 0.2;
// An arm with a smaller reach counts as small: for it even a tenth of the hand's path is a tenth of all that the tool
// can reach.
constexpr double small_reach_m = 0.25;
// Factor on the smallest steady mass, because only two hands are tried, and the gears are estimates.
constexpr double margin = 1.25;

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw SetupError({.file = file.string(), .message = "can't be written"});
}

// Returns the robot's name as the name of a folder. Characters that shells or paths treat specially become "_".
std::string folder_name(std::string name) {
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '.') c = '_';
  }
  return name.empty() || name.front() == '.' ? "cell" : name;
}

class NewCell {
 public:
  explicit NewCell(const NewCellOptions& options) : options_(options), source_(read_arm(options)) {
    folder_ = options.out.empty() ? fs::path(folder_name(source_.name)) : options.out;
    // The cell's file has this name until the cell is complete. So a cell that fails can be inspected, and doesn't
    // block the next try.
    file_ = folder_ / "unfinished-cell.yaml";
    std::error_code ignored;
    if (!options.force && fs::exists(folder_ / "cell.yaml", ignored)) {
      throw SetupError({.key = "--out",
                        .found = (folder_ / "cell.yaml").string() + ", which is there already",
                        .expected = "a folder without a cell",
                        .advice = "--force writes over it"});
    }
    fs::create_directories(folder_);
    write(folder_ / "arm.urdf", source_.urdf);
    copy_sensor();
    begin();
  }

  int make() {
    try {
      make_cell();
    } catch (const SetupError& error) {
      throw in_terms_of_the_arm(error);
    }
    fs::rename(file_, folder_ / "cell.yaml");
    run_.cell = file_ = folder_ / "cell.yaml";
    for (const std::string& line : controller::surprises(controller::prepare(run_))) source_.remarks.push_back(line);
    tell();
    return 0;
  }

 private:
  void make_cell() {
    aim_sensor();
    save();
    for (std::string& remark : size_drives(cell_, source_.joints, options_.arm)) {
      source_.remarks.push_back(std::move(remark));
    }
    choose();
  }

  // Returns an error in the cell that was tried as an error in the arm's file, because the user knows only that file.
  [[nodiscard]] SetupError in_terms_of_the_arm(const SetupError& error) const {
    description::SetupProblem problem = error.problem();
    const fs::path mine[] = {file_, folder_ / "arm.urdf", fs::absolute(file_), fs::absolute(folder_ / "arm.urdf")};
    if (std::find(std::begin(mine), std::end(mine), fs::path(problem.file)) == std::end(mine)) return error;
    problem.file = options_.arm.string();
    problem.line = problem.column = 0;
    if (!problem.advice.empty()) problem.advice += "; ";
    problem.advice += "the cell that was tried is " + file_.string();
    return SetupError(std::move(problem));
  }

  void copy_sensor() {
    fs::path file = options_.sensor;
    std::error_code ignored;
    if (!fs::exists(file, ignored)) file = controller::shipped_file("models/sensors/" + options_.sensor + ".yaml");
    sensor_ = description::load_sensor(file);
    if (sensor_.described && sensor_.described->registers) {
      throw SetupError({.key = "--sensor",
                        .found = options_.sensor + ", a sensor on Modbus",
                        .expected = "one on CAN, such as ati_net_can_oem",
                        .advice = "models/cells/rail.yaml shows a cell with Modbus lines"});
    }
    if (sensor_.described && sensor_.described->datagrams) cell_.sensor.host = "127.0.0.1";
    fs::copy_file(file, folder_ / "sensor.yaml", fs::copy_options::overwrite_existing);
    if (sensor_.protocol == "ati_net_can_oem") {
      // With this base id the sensor's frames are sent before all other frames on a shared bus.
      sensor_keys_ = "  base_id: 0x12\n  sample_rate_Hz: 7147\n  bandwidth_Hz: 800\n";
      return;
    }
    if (sensor_.described && sensor_.described->has_base_id) {
      sensor_keys_ = "  base_id: " + std::to_string(sensor_.described->base_id_min) + "\n";
    }
    const double stream_Hz = sensor_.described ? sensor_.described->rate_Hz : 0.0;
    sensor_keys_ += "  sample_rate_Hz: " + description::number_text(stream_Hz > 0.0 ? stream_Hz : 1000.0) + "\n";
  }

  void begin() {
    cell_.name = source_.name.empty() ? "own arm" : source_.name;
    cell_.tool = {.mass_kg = 0.25,
                  .centre_of_mass_S_m = {0, 0, 0.06},
                  .inertia_kg_m2 = {3.25e-4, 3.25e-4, 5.0e-5, 0, 0, 0},
                  .handle_S = {.position_m = {0, 0, 0.1}},
                  .shape = {}};
    cell_.sensor.link = source_.tip;
    cell_.default_mass_kg = 10.0;
    cell_.default_period_s = 1e-3;
    for (std::size_t i = 0; i < source_.joints.size(); ++i) {
      const ChainJoint& joint = source_.joints[i];
      description::DriveDescription drive;
      drive.joint = joint.name;
      drive.node = static_cast<std::uint8_t>(i + 1);
      drive.gear_ratio = 120.0;
      drive.range_rad = joint.range;
      drive.eds = options_.eds.empty() ? "" : fs::absolute(options_.eds).string();
      drive.max_speed_rad_per_s = drive.max_acceleration_rad_per_s2 = drive.rotor_inertia_kg_m2 = 1.0;
      drive.gear_stiffness_Nm_per_rad = 1e4;
      drive.gear_damping_Nms_per_rad = drive.simulation.gear_damping_Nms_per_rad = 1.0;
      drive.max_torque_Nm = drive.simulation.max_torque_Nm = 100.0;
      drive.simulation.position_gain_per_s = 350.0;
      drive.simulation.velocity_bandwidth_Hz = 200.0;
      cell_.drives.push_back(drive);
      cell_.start_rad.push_back(0.5 * (joint.range[0] + joint.range[1]));
    }
    place_on_buses(3);
    save();
  }

  void save() {
    write(file_, cell_text(cell_, source_.remarks, with_scene_, sensor_keys_));
    description::Cell loaded = description::load_cell(file_);
    cell_.file = loaded.file;
    cell_.urdf = loaded.urdf;
    run_.cell = file_;
  }

  void aim_sensor() {
    const models::Arm arm(cell_);
    const models::Mat3 R = models::rotation_from_z(outwards_in_sensor(arm)).toRotationMatrix();
    const models::Vec3 ypr = R.eulerAngles(2, 1, 0);
    const auto rounded = [](double x) { return std::round(1e6 * x) / 1e6 + 0.0; };
    cell_.sensor.pose_link.rpy_rad = {rounded(ypr[2]), rounded(ypr[1]), rounded(ypr[0])};
  }

  // Returns the smallest mass that is stable with margins from this start; infinite if there is none, or if the arm
  // can't start there. The files and remarks of this start stay.
  double least_kg(const StartPose& start, const models::Arm& arm, const models::ToolSpace& space,
                  const description::HandDescription& hand) {
    constexpr double never = std::numeric_limits<double>::infinity();
    begin_at(start, arm, space, hand);
    save();
    try {
      const controller::PreparedSession session = controller::prepare(run_);
      controller::LoopModel loop = controller::led_loop(session);
      loop.horizon_s = 0.0;
      return smallest_with_margins(controller::hand_model(session), loop).value_or(never);
    } catch (const SetupError&) {
      return never;
    }
  }

  // Sorts the starts by least_kg(). Masses that differ by less than about a fifth count as equal; among starts with
  // equal masses the better pose comes first.
  void sort_by_mass(std::vector<StartPose>& starts, const models::Arm& arm, const models::ToolSpace& space,
                    const description::HandDescription& hand) {
    constexpr double step = 1.2;
    std::vector<std::pair<double, StartPose>> judged;
    for (const StartPose& start : starts) {
      judged.emplace_back(std::floor(std::log(least_kg(start, arm, space, hand)) / std::log(step)), start);
    }
    std::stable_sort(judged.begin(), judged.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t k = 0; k < starts.size(); ++k) starts[k] = judged[k].second;
  }

  // Chooses the best start from which the arm is steady.
  void choose() {
    constexpr std::size_t judged = 8, most = 3;
    const models::Arm arm(cell_);
    const models::ToolSpace space = models::tool_space(arm);
    const description::HandDescription hand =
        with_way_in(space, description::load_hand(controller::shipped_file("sim/hands/touch.yaml")));
    const std::vector<std::string> remarks = source_.remarks;
    std::optional<SetupError> first;
    std::vector<StartPose> starts = find_starts(arm, hand, judged);
    if (starts.size() > 1) sort_by_mass(starts, arm, space, hand);
    if (starts.size() > most) starts.resize(most);
    for (const StartPose& start : starts) {
      source_.remarks = remarks;
      if (first)
        source_.remarks.push_back("from a start that looked better it wasn't fine: " + first->problem().message);
      begin_at(start, arm, space, hand);
      try {
        choose_buses();
        save();
        advise_mass();
        save();
        return controller::require_runnable(controller::prepare(run_), run_);
      } catch (const SetupError& error) {
        if (!first) first = error;
        if (start.way == 0.0) refuse_without_way(arm);
      }
    }
    throw SetupError(*first);
  }

  [[noreturn]] void refuse_without_way(const models::Arm& arm) const {
    const double reach_m = arm.path_curvature().maxCoeff();  // 1 if a joint slides
    const bool small = reach_m > 0.0 && reach_m < small_reach_m;
    const std::string which =
        small ? "that reaches " + description::rounded_text(reach_m) + " m with its handle, and " : "";
    throw SetupError(
        {.file = options_.arm.string(),
         .found =
             "an arm " + which + "whose tool can't go straight for 22 mm, a tenth of the hand's way, from any pose",
         .expected = small ? "an arm that has room for a hand's motion" : "joints that move it ahead and to the side",
         .advice = small ? "are its lengths in m?"
                         : "do joints coincide, are their ranges too narrow, are lengths in another unit than m?"});
  }

  void begin_at(const StartPose& start, const models::Arm& arm, const models::ToolSpace& space,
                const description::HandDescription& hand) {
    for (int i = 0; i < arm.axes(); ++i) cell_.start_rad[static_cast<std::size_t>(i)] = start.q[i];
    start_W_ = arm.tool_pose(start.q).translation();
    cell_.default_hand.clear();
    if (start.way < 1.0 || space.dimensions < 3) write_hand(with_shorter_way(hand, start.way), start.way);
    with_scene_ = space.dimensions == 3 && start.way > 0.0;
    if (!with_scene_) {
      source_.remarks.push_back("no scene of its own: the tool can't go ahead and to the side from where it starts");
      return;
    }
    char text[320];
    std::snprintf(
        text, sizeof text,
        "# A wall across x, %.3g m in front of where the tool starts (x %.4f, y %.4f, z %.4f m).\nname: wall\n"
        "objects:\n  - plane: {name: wall, point_m: [%.4f, 0, 0], normal: [-1, 0, 0], friction: 0.3}\n",
        wall_ahead_m * start.way, start_W_.x(), start_W_.y(), start_W_.z(), start_W_.x() + wall_ahead_m * start.way);
    write(folder_ / "scene.yaml", text);
  }

  // Writes a hand for an arm that is too small for the default hand's path of 0.22 m, or whose tool moves only in a
  // plane or on a line. `share` is the share of the path for which the arm has room; with 0 the hand holds still.
  void write_hand(const description::HandDescription& hand, double share) {
    char text[200], way[80] = "a way that is turned to where the tool can go";
    if (share < 1.0) std::snprintf(way, sizeof way, "%.3g of its way: for that of 0.22 m the arm has no room", share);
    source_.remarks.push_back("a hand of its own, the default one with " + std::string(way));
    std::string file = "# sim/hands/touch.yaml with " + std::string(way) + ".\n";
    std::snprintf(text, sizeof text,
                  "name: touch with a way of its own\nmass_kg: %.6g\nstiffness_N_per_m: %.6g\n"
                  "damping_Ns_per_m: %.6g\nwaypoints:\n",
                  hand.mass_kg, hand.stiffness_N_per_m, hand.damping_Ns_per_m);
    file += text;
    for (const description::Waypoint& waypoint : hand.waypoints) {
      const auto& to = waypoint.offset_m;
      std::snprintf(text, sizeof text, "  - {time_s: %.6g, offset_m: [%.6g, %.6g, %.6g]}\n", waypoint.time_s, to[0],
                    to[1], to[2]);
      file += text;
    }
    write(folder_ / "hand.yaml", file);
    cell_.default_hand = folder_ / "hand.yaml";
  }

  // Places the axes on the buses in their order. Each bus has equally many axes, except the last bus, which has the
  // sensor and fewest axes.
  void place_on_buses(int count) {
    const int axes = static_cast<int>(cell_.drives.size());
    // The sensor's frames take about as long as those of this many drives.
    constexpr double sensor_as_axes = 1.5;
    const int each = count == 1 ? axes : static_cast<int>(std::ceil((axes + sensor_as_axes) / count));
    cell_.buses.clear();
    for (int b = 0; b < count; ++b) {
      cell_.buses.push_back({.name = "bus_" + std::to_string(b + 1)});
    }
    for (int i = 0; i < axes; ++i) {
      cell_.drives[static_cast<std::size_t>(i)].bus =
          cell_.buses[static_cast<std::size_t>(std::min(i / each, count - 1))].name;
    }
    if (!cell_.sensor.on_udp()) cell_.sensor.bus = cell_.buses.back().name;
  }

  // Returns whether this number of buses carries this timestep. Leaves the cell with the shortest receive window that
  // suffices.
  bool carries(int buses, double period_s) {
    place_on_buses(buses);
    cell_.default_period_s = period_s;
    for (const double window : {0.45, 0.55, 0.65, 0.75}) {
      cell_.receive_window = window;
      save();
      if (controller::is_carried(controller::prepare(run_))) return true;
    }
    return false;
  }

  void choose_buses() {
    const int most = static_cast<int>(cell_.drives.size()) + 1;
    for (const double period_ms : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0}) {
      for (int buses = options_.buses.value_or(1); buses <= options_.buses.value_or(most); ++buses) {
        if (carries(buses, 1e-3 * period_ms)) return;
      }
    }
    throw SetupError({.key = "--buses",
                      .found = std::to_string(options_.buses.value_or(most)),
                      .expected = "buses that carry a timestep of 10 ms or less"});
  }

  // Returns the smallest tried mass with which the simulated arm is steady with two hands: the default scene's hand,
  // which moves in a plane, and a hand that moves freely in all directions. Returns nullopt if no tried mass is.
  std::optional<double> advised_mass() {
    const controller::PreparedSession session = controller::prepare(run_);
    controller::LoopModel loop = controller::led_loop(session);
    loop.horizon_s = 0.0;
    const auto least = smallest_with_margins(controller::hand_model(session), loop);
    if (!least) {
      advice_ = "by the model of the loop none is";
      return std::nullopt;
    }
    const TriedAdvice touching = tried_mass(session, rounded_up(*least));
    advice_ = touching.text;
    if (!touching.steady) return std::nullopt;
    controller::RunOptions sweep = run_;
    sweep.scene = controller::shipped_file("scenes/free.yaml");
    sweep.hand = controller::shipped_file("sim/hands/sweep.yaml");
    sweep.duration_s = 20.0;
    const TriedAdvice free = tried_mass(controller::prepare(sweep), *touching.steady);
    advice_ += "; in free space " + free.text;
    return free.steady;
  }

  std::optional<double> advised_mass_with(double damping_Ns_per_m) {
    cell_.default_damping_Ns_per_m = damping_Ns_per_m;
    save();
    return advised_mass();
  }

  // Returns advised_mass() with the best damping. If the mass without damping is one that hands lead easily, there is
  // no damping. Otherwise also tries dampings so small that a hand takes them for a heavier handle, and keeps the
  // smallest one that saves a quarter of the mass.
  std::optional<double> advised_mass_and_damping() {
    constexpr double easy_kg = 10.0, worth = 0.75;
    const auto without = advised_mass_with(0.0);
    if (without && *without <= easy_kg) return without;
    const std::string advice = advice_;
    for (const double damping_Ns_per_m : {0.5 * most_for_comfort_Ns_per_m, most_for_comfort_Ns_per_m}) {
      const auto with = advised_mass_with(damping_Ns_per_m);
      if (!with || (without && *with > worth * *without)) continue;
      advice_ = "with " + description::rounded_text(damping_Ns_per_m) + " Ns/m " + advice_ + "; without: " + advice;
      return with;
    }
    cell_.default_damping_Ns_per_m = 0.0;
    advice_ = advice;
    return without;
  }

  // Chooses the mass, the damping and the setpoint filter. If no mass is stable or steady, the arm's gears are too soft
  // for the filter, so the next slower filter is tried.
  void advise_mass() {
    std::string with_the_fastest;  // the advice with the fastest filter
    for (const double bandwidth_Hz : {25.0, 15.0, 10.0}) {
      cell_.limits.setpoint_bandwidth_Hz = bandwidth_Hz;
      const auto mass_kg = advised_mass_and_damping();
      if (with_the_fastest.empty()) with_the_fastest = advice_;
      if (!mass_kg) continue;
      cell_.default_mass_kg = rounded_up(margin * *mass_kg);
      return;
    }
    throw SetupError({.file = file_.string(),
                      .key = "default_mass_kg",
                      .message = "no mass up to 1000 kg is stable with margins and steady: " + with_the_fastest,
                      .advice = "stiffer gears, stronger drives (the URDF's effort and velocity), or a shorter "
                                "timestep (--buses)"});
  }

  void tell() const {
    const double damping_Ns_per_m = cell_.default_damping_Ns_per_m;
    const std::string damped =
        damping_Ns_per_m > 0.0 ? " with " + description::rounded_text(damping_Ns_per_m) + " Ns/m" : "";
    std::printf("%s: a cell of %zu %s, sensor on %s, %zu %s, T = %.4g ms, %.3g kg%s\n", file_.c_str(),
                cell_.drives.size(), cell_.drives.size() == 1 ? "axis" : "axes", cell_.sensor.link.c_str(),
                cell_.buses.size(), cell_.buses.size() == 1 ? "bus" : "buses", 1e3 * cell_.default_period_s,
                cell_.default_mass_kg, damped.c_str());
    std::printf("the tool starts at x %.4f, y %.4f, z %.4f m\ntried on the simulated arm: %s\n", start_W_.x(),
                start_W_.y(), start_W_.z(), advice_.c_str());
    for (const std::string& remark : source_.remarks) std::printf("  - %s\n", remark.c_str());
    std::printf("gears, rotors and friction are ESTIMATED; so are encoders' counts. Now:\n  proxarm run %s\n",
                file_.c_str());
  }

  const NewCellOptions& options_;
  ArmSource source_;
  fs::path folder_, file_;
  description::Cell cell_;
  description::SensorDescription sensor_;
  std::string sensor_keys_, advice_;
  bool with_scene_ = false;
  models::Vec3 start_W_ = models::Vec3::Zero();
  controller::RunOptions run_;
};

}  // namespace

int new_cell_command(const NewCellOptions& options) { return NewCell(options).make(); }

}  // namespace proxarm::command_line

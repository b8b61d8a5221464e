// Cells, sensors and hands: the files that come with the project load, and every mistake in them has its message.
#include "models/description/cell.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "models/base/setup_error.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "tests/source_file.hpp"

namespace proxarm::description {
namespace {

using testing::HasSubstr;

const std::filesystem::path source_dir = source_file();

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A file of the project, changed, in a folder from which its relative paths still lead somewhere.
class Changed {
 public:
  explicit Changed(const std::string& original) : text_(read(source_dir / original)) {
    file_ = std::filesystem::path(testing::TempDir()) / ("proxarm_changed_" + std::to_string(getpid()) + ".yaml");
    replace("../../../../", source_dir.string() + "/", false);
    replace("../../", (source_dir / "tests/models").string() + "/", false);
  }
  ~Changed() { std::filesystem::remove(file_); }
  Changed(const Changed&) = delete;
  Changed& operator=(const Changed&) = delete;

  Changed& replace(const std::string& from, const std::string& to, bool once = true) {
    std::size_t at = text_.find(from);
    if (once) {
      EXPECT_NE(at, std::string::npos) << from;
    }
    for (; at != std::string::npos; at = once ? std::string::npos : text_.find(from, at + to.size())) {
      text_.replace(at, from.size(), to);
    }
    return *this;
  }
  void set_text(const std::string& text) { text_ = text; }
  [[nodiscard]] const std::string& text() const { return text_; }

  template <class Load>
  std::string told(Load load) const {
    std::ofstream(file_, std::ios::binary) << text_;
    try {
      (void)load(file_);
    } catch (const SetupError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      EXPECT_EQ(error.file(), file_.string()) << error.what();
      return error.what();
    }
    return "no error";
  }
  [[nodiscard]] int line_of(const std::string& words) const {
    if (text_.find(words) == std::string::npos) return -1;
    return static_cast<int>(std::count(text_.begin(), text_.begin() + static_cast<long>(text_.find(words)), '\n')) + 1;
  }

 private:
  std::string text_;
  std::filesystem::path file_;
};

constexpr const char* default_cell = "models/cells/default.yaml";
constexpr const char* fixed_cell = "tests/models/description/data/default.yaml";
constexpr const char* default_sensor = "models/sensors/ati_net_can_oem.yaml";

TEST(Cell, TheDefaultOneLoads) {
  const Cell cell = load_cell(source_dir / default_cell);
  EXPECT_EQ(cell.drives.size(), 6U);
  EXPECT_EQ(cell.buses.size(), 3U);
  EXPECT_EQ(cell.start_rad.size(), 6U);
  EXPECT_TRUE(cell.urdf.is_absolute());
  EXPECT_TRUE(std::filesystem::exists(cell.urdf));
  EXPECT_TRUE(std::filesystem::exists(cell.sensor.description));
  EXPECT_EQ(cell.sensor.base_id, 0x68U);
  EXPECT_EQ(cell.drives[0].device_type, 0x00020192U);
  const DriveDescription& drive = cell.drives[1];
  EXPECT_EQ(drive.counts_per_rad(),
            drive.direction * drive.counts_per_motor_revolution * drive.gear_ratio / (2.0 * std::numbers::pi));
}

TEST(Cell, TheDefaultOneLoadsByARelativePathToo) {
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(source_dir / "models");
  const Cell cell = load_cell("cells/default.yaml");
  std::filesystem::current_path(before);
  EXPECT_EQ(cell.file, source_dir / default_cell);
  EXPECT_TRUE(cell.urdf.is_absolute());
}

struct Mistake {
  const char* from;
  const char* to;
  const char* told;
};

class CellMistakes : public testing::TestWithParam<Mistake> {};

TEST_P(CellMistakes, AreTold) {
  Changed cell(fixed_cell);
  cell.replace(GetParam().from, GetParam().to);
  EXPECT_THAT(cell.told(load_cell), HasSubstr(GetParam().told));
}

INSTANTIATE_TEST_SUITE_P(
    All, CellMistakes,
    testing::Values(
        Mistake{"urdf: ", "urfd: ", "urdf: found nothing, expected a file's path; is \"urfd\" below meant to be it?"},
        Mistake{"data/arm150.urdf", "data/arm15.urdf", "urdf: found"},
        Mistake{"node: 2", "node: 1",
                "drives[1].node: found 1, expected a node that is free on bus axes_1_3; joint \"axis_1\" "
                "has it already"},
        Mistake{"node: 2", "node: 0", "drives[1].node: found 0, expected a whole number from 1 to 127"},
        Mistake{"node: 2", "node: 128", "drives[1].node: found 128, expected a whole number from 1 to 127"},
        Mistake{"joint: axis_2", "joint: axis_1",
                "drives[1].joint: found \"axis_1\", expected a joint that no other drive"},
        Mistake{"bus: axes_4_6", "bus: axes_46",
                "drives[3].bus: found \"axes_46\", expected a bus of this cell: axes_1_3, "
                "axes_4_6 or sensor; did you mean \"axes_4_6\"?"},
        Mistake{"name: axes_4_6", "name: axes_1_3",
                "buses[1].name: found \"axes_1_3\", expected a name that no other bus"},
        Mistake{"name: axes_4_6", "name: axes=4", "buses[1].name: found \"axes=4\", expected a name of letters"},
        Mistake{"bitrate: 1000000", "bitrate: 1234567",
                "buses[0].bitrate: found 1234567, expected a whole number from 10000 to "
                "1000000 bit/s"},
        Mistake{"bitrate: 1000000", "bitrate: 123456", "buses[0].bitrate: found 123456, expected 10000, 20000"},
        Mistake{"bitrate: 1000000", "bitrate: 1000000, data_bitrate: 500000", "buses[0].data_bitrate: found 500000"},
        Mistake{"range_rad: [-2.9, 2.9]", "range_rad: [2.9, -2.9]",
                "drives[0].range_rad: found [2.9, -2.9], expected [lowest, "
                "highest] angle, in this order"},
        Mistake{"range_rad: [-2.9, 2.9]", "range_rad: [-2.9]",
                "drives[0].range_rad: found a list of 1, expected a list of 2"},
        Mistake{"range_rad: [-2.9, 2.9]", "range_rad: [-200, 2.9]",
                "drives[0].range_rad: found -200 rad = -5006581608 counts"},
        Mistake{"start_rad: [0, 0.0675", "start_rad: [0, 2.5",
                "start_rad[1]: found 2.5, expected an angle in the range of joint "
                "\"axis_2\", -1.6 to 2.3 rad"},
        Mistake{"start_rad: [0, ", "start_rad: [", "start_rad: found a list of 5, expected a list of 6 numbers in rad"},
        Mistake{"direction: -1", "direction: 0", "drives[1].direction: found 0, expected 1 or -1"},
        Mistake{"profile: cia402", "profile: cia401", "drives[0].profile: found \"cia401\", expected cia402"},
        Mistake{"mode: csp", "mode: cst", "drives[0].rated_torque_Nm"},
        Mistake{"mode: csp", "max_torque_Nm: 0\n    mode: csp",
                "drives[0].max_torque_Nm: found 0, expected a number above 0"},
        Mistake{"mode: csp", "objects: {target: 60C1h}\n    mode: csp", "drives[0].objects.target: found \"60C1h\""},
        Mistake{"mode: csp", "eds: nowhere.eds\n    mode: csp", "drives[0].eds"},
        Mistake{"mode: csp", "mode: velocity", "drives[0].mode: found \"velocity\", expected csp, ip or cst"},
        Mistake{"gear_ratio: 150", "gear_ratio: 0", "drives[0].gear_ratio: found 0, expected a number above 0"},
        Mistake{"max_torque_Nm: 2500", "max_torque_Nm: -1",
                "drives[0].simulation.max_torque_Nm: found -1, expected a number above "
                "0 and at most 1000000 Nm"},
        Mistake{"servo_rate_Hz: 4000", "servo_rate_Hz: 1e9",
                "drives[0].simulation.servo_rate_Hz: found 1e9, expected a number "
                "from 1000 to 100000 Hz"},
        Mistake{"mass_kg: 0.25", "mass_kg: -0.25", "tool.mass_kg: found -0.25, expected a number from 0 to 1000 kg"},
        Mistake{"mass_kg: 0.25", "mass: 0.25", "tool.mass_kg: found nothing"},
        Mistake{"[3.25e-4, 3.25e-4, 5.0e-5, 0, 0, 0]", "[1, 1, 3, 0, 0, 0]",
                "tool.inertia_kg_m2: found a list of 6, expected a "
                "physical inertia"},
        Mistake{"[3.25e-4, 3.25e-4, 5.0e-5, 0, 0, 0]", "[1, 1, 1, 2, 0, 0]", "expected a physical inertia"},
        Mistake{"base_id: 0x68", "base_id: -1", "sensor.base_id: found -1"},
        Mistake{"bus: sensor", "bus: snsor", "sensor.bus: found \"snsor\", expected a bus of this cell"},
        Mistake{"sensors/ati_net_can_oem.yaml", "sensors/ati.yaml", "sensor.description: found"},
        Mistake{"leash_m: 0.02", "leash_m: 0", "limits.leash_m: found 0, expected a number above 0 and at most 1 m"},
        Mistake{"leash_m: 0.02", "workspace_m: {min: [0, 0, 0], max: [1, 0, 1]}", "limits.workspace_m.max"},
        Mistake{"leash_m: 0.02", "workspace_m: {min: [0, 0, 0]}", "limits.workspace_m.max: found nothing"},
        Mistake{"leash_m: 0.02", "keep_out_m: [{min: [0, 0, 0], maxx: [1, 1, 1]}]", "limits.keep_out_m[0].max"},
        Mistake{"leash_m: 0.02", "leash_mm: 20", "limits.leash_mm: unknown key; did you mean \"leash_m\"?"},
        Mistake{"default_period_s: 0.001", "default_period_s: 1",
                "default_period_s: found 1, expected a number from 0.0001 to 0.1"},
        Mistake{"default_mass_kg: 4", "default_mass_kg: 4kg",
                "default_mass_kg: found \"4kg\", expected a number above 0 and at most "
                "1000 kg; write the number alone"},
        Mistake{"tool:", "tool: [1, 2]\ntool2:", "tool: found a list of 2, expected a map"},
        Mistake{"buses:", "busses:",
                "buses: found nothing, expected a list of 0 to 16 entries; is \"busses\" below meant"}));

TEST(Cell, LinesAreThoseOfTheFile) {
  Changed cell(fixed_cell);
  cell.replace("gear_stiffness_Nm_per_rad: 310000", "gear_stiffness_Nm_per_rad: -310000");
  EXPECT_THAT(cell.told(load_cell), HasSubstr(".yaml:" + std::to_string(cell.line_of("rad: -310000")) +
                                              ": drives[1].gear_stiffness_Nm_per_rad"));
}

TEST(Cell, InertiasOnTheEdgeOfThePhysicalAreTaken) {
  for (const char* inertia :
       {"[0, 0, 0, 0, 0, 0]", "[1, 1, 2, 0, 0, 0]", "[1, 1, 2.00001, 0, 0, 0]", "[2, 2, 2, 0.5, 0.5, 0.5]"}) {
    Changed cell(fixed_cell);
    cell.replace("[3.25e-4, 3.25e-4, 5.0e-5, 0, 0, 0]", inertia);
    EXPECT_EQ(cell.told(load_cell), "no error") << inertia;
  }
}

TEST(Cell, DefaultsMayBeLeftOut) {
  Changed cell(fixed_cell);
  for (const char* line : {"default_period_s: 0.001\n", "default_mass_kg: 4\n", "profile: cia402\n", "mode: csp\n"}) {
    cell.replace(line, "\n");
  }
  EXPECT_EQ(cell.told(load_cell), "no error");
}

// ---- sensors --------------------------------------------------------------------------------------------------------

TEST(Sensor, TheAtiOneLoadsAndReachesItsRange) {
  const SensorDescription sensor = load_sensor(source_dir / default_sensor);
  EXPECT_EQ(sensor.protocol, "ati_net_can_oem");
  // Every gauge at ±32767 must reach the stated range in each component on its own.
  const auto& s = sensor.simulation;
  for (std::size_t i = 0; i < 6; ++i) {
    double reach = 0.0;
    for (const double x : s.matrix[i]) reach += std::abs(x) * 32767.0;
    reach /= i < 3 ? s.counts_per_N : s.counts_per_Nm;
    EXPECT_GT(reach, i < 3 ? sensor.force_range_N[i] : sensor.torque_range_Nm[i - 3]);
    for (const double x : s.matrix[i]) EXPECT_EQ(x, static_cast<double>(static_cast<float>(x)));
  }
}

SensorDescription as_delivered(const std::filesystem::path& file) { return load_sensor(file); }

TEST(Sensor, MistakesAreTold) {
  const auto told = [](const char* from, const char* to) {
    Changed sensor(default_sensor);
    return sensor.replace(from, to).told(as_delivered);
  };
  EXPECT_THAT(told("protocol: ati_net_can_oem", "protocol: ati"),
              HasSubstr("protocol: found \"ati\", expected ati_net_can_oem or described"));
  EXPECT_THAT(told("force_range_N: [330, 330, 330]", "force_range_N: [330, 330, 0]"),
              HasSubstr("force_range_N[2]: found 0, expected a number above 0"));
  EXPECT_THAT(told("counts_per_N: 1000000", "counts_per_N: 0"), HasSubstr("simulation.counts_per_N: found 0"));
  EXPECT_THAT(told("bias_counts: [-812", "bias_counts: [-40000"), HasSubstr("simulation.bias_counts[0]: found -40000"));
  EXPECT_THAT(told("simulation:", "simulations:"), HasSubstr("simulation: found nothing"));
  EXPECT_THAT(told("name: ", "title: "), HasSubstr("name: found nothing"));
}

TEST(Sensor, AMatrixThatCantBeInvertedIsRefused) {
  Changed sensor(default_sensor);
  sensor.set_text(
      "name: x\nprotocol: ati_net_can_oem\nforce_range_N: [1, 1, 1]\ntorque_range_Nm: [1, 1, 1]\nsimulation:\n  "
      "matrix:\n  - [1, 0, 0, 0, 0, 0]\n  - [0, 1, 0, 0, 0, 0]\n  - [0, 0, 1, 0, 0, 0]\n  - [0, 0, 0, 1, 0, 0]\n  - "
      "[0, 0, 0, 0, 1, 0]\n  - [0, 0, 0, 0, 0, 1]\n");
  EXPECT_EQ(sensor.told(as_delivered), "no error");
  sensor.replace("[0, 0, 0, 0, 1, 0]", "[0, 0, 0, 2, 0, 0]");
  EXPECT_THAT(sensor.told(as_delivered), HasSubstr("simulation.matrix: found one of condition "));
  sensor.replace("[0, 0, 0, 2, 0, 0]", "[0, 0, 0, 0, 0, 0]");
  EXPECT_THAT(sensor.told(as_delivered), HasSubstr("simulation.matrix: found one of condition "));
  sensor.replace("[0, 0, 0, 0, 0, 0]", "[0, 0, 0, 0, 0]");
  EXPECT_THAT(sensor.told(as_delivered), HasSubstr("simulation.matrix[4]: found a list of 5"));
}

// ---- hands ----------------------------------------------------------------------------------------------------------

TEST(Hand, AllOfTheProjectLoad) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir / "sim/hands")) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(load_hand(entry.path())) << entry.path();
    ++count;
  }
  EXPECT_GT(count, 0);
}

std::string hand_told(const std::string& text) {
  Changed hand("sim/hands/touch.yaml");
  hand.set_text(text);
  return hand.told(load_hand);
}

TEST(Hand, MistakesAreTold) {
  EXPECT_EQ(hand_told("name: rests\n"), "no error");
  EXPECT_THAT(hand_told("stiffness: 5\n"), HasSubstr("stiffness: unknown key; did you mean \"stiffness_N_per_m\"?"));
  EXPECT_THAT(hand_told("mass_kg: -1\n"), HasSubstr("mass_kg: found -1, expected a number from 0 to 100 kg"));
  EXPECT_THAT(hand_told("waypoints:\n  - {time_s: 1, offset_m: [0, 0, 0]}\n  - {time_s: 1, offset_m: [0, 0, 0]}\n"),
              HasSubstr(":3: waypoints[1].time_s: found 1, expected a time after the one before, 1 s"));
  EXPECT_THAT(hand_told("waypoints:\n  - {time_s: 1, offset_m: [0, 0, 0], speed: 3}\n"),
              HasSubstr("waypoints[0].speed"));
  EXPECT_THAT(hand_told("multisine:\n  - {frequency_Hz: 1, amplitude_m: 1, direction: [0, 0, 0]}\n"),
              HasSubstr("multisine[0].direction: found 0, expected a direction of length 0.001 or more"));
  EXPECT_THAT(hand_told("multisine:\n  - {frequency_Hz: 0, amplitude_m: 1, direction: [0, 0, 1]}\n"),
              HasSubstr("multisine[0].frequency_Hz: found 0, expected a number above 0"));
}

TEST(Hand, DirectionsHaveLengthOne) {
  const auto file = std::filesystem::path(testing::TempDir()) / ("proxarm_hand_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(file) << "multisine:\n  - {frequency_Hz: 1, amplitude_m: 0.1, direction: [3, 0, 4]}\n";
  const HandDescription hand = load_hand(file);
  std::filesystem::remove(file);
  EXPECT_EQ(hand.multisine[0].direction, (std::array<double, 3>{3.0 / 5.0, 0.0, 4.0 / 5.0}));
  EXPECT_EQ(hand.name, file.stem());
}

// ---- damaged files --------------------------------------------------------------------------------------------------

// Whatever stands in a file, the answer is a description or a SetupError.
TEST(DamagedFiles, NeverDoMoreThanFail) {
  constexpr unsigned seed = 301;
  RecordProperty("seed", seed);
  std::mt19937 engine(seed);
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); };
  const char* scale_text = std::getenv("PROXARM_TEST_SCALE");
  const double scale = scale_text != nullptr ? std::atof(scale_text) : 1.0;
  const std::array<std::string, 3> originals{fixed_cell, default_sensor, "sim/hands/touch.yaml"};
  const std::string salad = "[]{}:,-#&*!|>'\"%@`? \n\t~<0123456789.eE+\\\x00\x80\xff";
  for (int n = 0; n < 1500 * scale; ++n) {
    const std::size_t kind = below(3);
    Changed file(originals[kind]);
    std::string text = file.text();
    switch (below(4)) {
      case 0:
        text.resize(below(text.size()));
        break;
      case 1:
        for (std::size_t i = below(8) + 1; i > 0; --i) text[below(text.size())] = salad[below(salad.size())];
        break;
      case 2:
        for (std::size_t i = below(8) + 1; i > 0; --i) text.insert(below(text.size()), 1, salad[below(salad.size())]);
        break;
      default: {  // a piece moved
        const std::size_t at = below(text.size()), length = below(std::min<std::size_t>(200, text.size() - at)) + 1;
        const std::string piece = text.substr(at, length);
        text.erase(at, length);
        text.insert(below(text.size()), piece);
      }
    }
    file.set_text(text);
    if (kind == 0) file.told(load_cell);
    if (kind == 1) file.told(as_delivered);
    if (kind == 2) file.told(load_hand);
  }
}

}  // namespace
}  // namespace proxarm::description

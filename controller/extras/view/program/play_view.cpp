#include "controller/extras/view/program/play_view.hpp"

#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "controller/command_line/entry/browser.hpp"
#include "controller/extras/view/program/page_channel.hpp"
#include "controller/extras/view/program/page_files.hpp"
#include "controller/extras/view/program/vibration.hpp"
#include "controller/extras/view/sources/frame_words.hpp"
#include "controller/extras/view/sources/recorded_session.hpp"
#include "controller/record/replay_log.hpp"
#include "models/base/setup_error.hpp"
#include "scenes/format/scene_file.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t window_rows = 800, overview_rows = 1200;

view::Stage stage_of(const fs::path& folder) {
  const controller::ReplayReader log(folder / controller::replay_folder / "cycles.bin");
  const controller::ReplayHead& head = log.head();
  const controller::SessionSettings& settings = head.settings;
  return {description::load_cell(controller::recorded_file(folder, head.cell.data())),
          scenes::load_scene_with(controller::recorded_file(folder, head.scene.data()),
                                  controller::recorded_tool(folder, head)),
          {.period_s = settings.period_s,
           .mass_kg = settings.mass_kg,
           .damping_Ns_per_m = settings.damping_Ns_per_m,
           .spring_N_per_m = settings.spring_N_per_m,
           .impedance = settings.scheme == controller::Scheme::impedance}};
}

const char* kind_name(view::RecordedEvent::Kind kind) {
  constexpr std::array names{"contact", "limit", "phase", "fault"};
  return names[static_cast<std::size_t>(kind)];
}

class PlayView {
 public:
  PlayView(boost::asio::io_context& context, const ViewOptions& options)
      : folder_(options.folder),
        stage_(stage_of(options.folder)),
        session_(options.folder, stage_),
        control_({}, context),
        page_(
            control_, [this](view::Socket& socket) { welcome(socket); },
            [this](view::Socket& socket, const json& said) { return give(socket, said); }),
        server_(
            context, {options.port, {}}, page_files(),
            [this](const std::string& path) { return mesh_file(stage_, path); }, page_, nullptr) {}

  [[nodiscard]] std::string url() const { return server_.url(); }

  // Returns the index of the last cycle that begins at this time or earlier.
  [[nodiscard]] std::size_t index_at(double time_s) const {
    std::size_t low = 0, high = session_.size() - 1;
    while (low < high) {
      const std::size_t middle = (low + high + 1) / 2;
      (session_.time_s(middle) <= time_s + 1e-9 ? low : high) =
          session_.time_s(middle) <= time_s + 1e-9 ? middle : middle - 1;
    }
    return low;
  }

 private:
  void welcome(view::Socket& socket) {
    json stage = json::parse(stage_.describe());
    stage["mode"] = "record";
    stage["control"] = false;
    json events = json::array();
    for (const view::RecordedEvent& event : session_.events()) {
      events.push_back(
          {{"kind", kind_name(event.kind)}, {"at", event.at}, {"time_s", event.time_s}, {"text", event.text}});
    }
    stage["record"] = {{"name", folder_.filename().string()}, {"cycles", session_.size()},
                       {"from_s", session_.time_s(0)},        {"to_s", session_.time_s(session_.size() - 1)},
                       {"open_at", session_.opening()},       {"events", events},
                       {"margins", margins_of(folder_)}};
    stage["threshold"] = threshold_json(threshold_);
    socket.say(text_of({{"stage", stage}}), false);
    socket.say(history(0, session_.size() - 1, overview_rows), true);
    show(socket, session_.opening());
  }

  // Returns the margins to instability at the places that the session passed, from its summary. Returns an empty list
  // for a black box.
  static json margins_of(const fs::path& folder) {
    json margins = json::array();
    std::ifstream in(folder / "summary.json");
    const json summary = json::parse(in, nullptr, false);
    constexpr const char* places = "/poses/places";
    const json::json_pointer at(places);
    if (!summary.is_object() || !summary.contains(at) || !summary.at(at).is_array()) return margins;
    for (const json& place : summary.at(at)) {
      const auto number = [&place](const char* key) {
        return place.is_object() && place.contains(key) && place[key].is_number() ? place[key] : json(nullptr);
      };
      margins.push_back({{"time_s", number("time_s")},
                         {"felt_mass_kg", number("felt_mass_kg")},
                         {"smallest_stable_mass_kg", number("smallest_stable_mass_kg")}});
    }
    return margins;
  }

  view::Bytes history(std::size_t from, std::size_t to, std::size_t rows) const {
    return std::make_shared<const std::string>(view::encode_history(session_.window(from, to, rows)));
  }

  void show(view::Socket& socket, std::size_t index) {
    socket.say(text_of({{"status", {{"fault", session_.is_faulted(index) ? session_.fault() : ""}, {"ended", ""}}}}),
               false);
    socket.say(std::make_shared<const std::string>(session_.encode(index)), true);
  }

  void list_frames(view::Socket& socket, std::size_t index) {
    json list = json::array();
    for (const controller::BoxFrame& frame : session_.frames(index)) {
      const view::FrameWords words = view::describe_frame(frame, session_.head(), stage_.cell());
      list.push_back(
          {{"bus", words.bus}, {"id", words.id}, {"bytes", words.bytes}, {"from", words.from}, {"words", words.words}});
    }
    socket.say(text_of({{"frames", {{"at", index}, {"list", list}}}}), false);
  }

  bool give(view::Socket& socket, const json& said) {
    if (!said.is_object() || said.size() != 1) return false;
    const auto is_index = [&](const json& value) {
      return value.is_number_unsigned() && value.get<std::uint64_t>() < session_.size();
    };
    const json::const_iterator first = said.begin();
    const std::string& name = first.key();
    const json& value = first.value();
    if (name == "at" && is_index(value)) {
      show(socket, value.get<std::size_t>());
    } else if (name == "frames" && is_index(value)) {
      list_frames(socket, value.get<std::size_t>());
    } else if (name == "spectrum" && is_index(value)) {
      const auto index = value.get<std::size_t>();
      json spectrum = spectrum_json(session_.spectrum(index), session_.has_truth(index), threshold_);
      spectrum["at"] = index;
      socket.say(text_of({{"spectrum", spectrum}}), false);
    } else if (name == "window" && value.is_array() && value.size() == 2 && is_index(value[0]) && is_index(value[1])) {
      socket.say(history(value[0].get<std::size_t>(), value[1].get<std::size_t>(), window_rows), true);
    } else {
      return false;
    }
    return true;
  }

  fs::path folder_;
  view::Stage stage_;
  view::RecordedSession session_;
  ControlLine control_;
  PageChannel page_;
  view::WebServer server_;
  assessment::VibrationThreshold threshold_ = vibration_threshold();
};

}  // namespace

namespace {

// Returns the picture's file: "a.png", or "a-01.png" and so on for several pictures.
fs::path picture_name(const ViewOptions& options, std::size_t index) {
  if (options.snapshots_s.size() == 1) return options.out;
  std::array<char, 24> number{};
  std::snprintf(number.data(), number.size(), "-%02zu", index + 1);
  fs::path name = options.out;
  return name.replace_filename(options.out.stem().string() + number.data() + options.out.extension().string());
}

// Opens the view's page in a browser without a window, and takes the pictures.
void take_pictures(const PlayView& shown, const ViewOptions& options) {
  HeadlessBrowser browser(options.size, options.dark);
  browser.open(shown.url());
  browser.wait_for("window.proxarm && performance.getEntriesByName('first-moment').length");
  browser.run("proxarm.world.drawFine(); proxarm.world.look('" + options.look + "')");
  for (std::size_t i = 0; i < options.snapshots_s.size(); ++i) {
    const std::string index = std::to_string(shown.index_at(options.snapshots_s[i]));
    browser.run("proxarm.player.goTo(" + index + ")");
    browser.wait_for("proxarm.player.isShown(" + index + ")");
    browser.save_picture(picture_name(options, i));
  }
}

int save_pictures(const ViewOptions& options) {
  boost::asio::io_context context{1};
  const PlayView shown(context, options);
  std::thread serving([&] { context.run(); });
  try {
    take_pictures(shown, options);
  } catch (...) {
    context.stop();
    serving.join();
    throw;
  }
  context.stop();
  serving.join();
  return 0;
}

}  // namespace

int play_view(const ViewOptions& options) {
  if (!options.snapshots_s.empty()) return save_pictures(options);
  boost::asio::io_context context{1};
  const PlayView shown(context, options);
  boost::asio::signal_set signals(context, SIGINT, SIGTERM, SIGHUP);
  signals.async_wait([&](const boost::system::error_code&, int) { context.stop(); });
  std::fprintf(stderr, "proxarm: the view of this record, until Ctrl-C: %s\n", shown.url().c_str());
  const BrowserDoor door(shown.url());
  context.run();
  return 0;
}

}  // namespace proxarm::command_line

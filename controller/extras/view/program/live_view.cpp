#include "controller/extras/view/program/live_view.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <istream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "controller/extras/view/program/page_channel.hpp"
#include "controller/extras/view/program/page_files.hpp"
#include "controller/extras/view/program/tool_channel.hpp"
#include "controller/extras/view/program/vibration.hpp"
#include "controller/extras/view/sources/live_source.hpp"
#include "controller/extras/view/web/gate.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/stage/words.hpp"
#include "models/base/setup_error.hpp"
#include "scenes/format/scene_file.hpp"

namespace proxarm::command_line {
namespace {

using boost::asio::local::stream_protocol;
using boost::system::error_code;
using nlohmann::json;

constexpr auto between_moments = std::chrono::microseconds(16'667);  // 60 a second
constexpr auto between_spectra = std::chrono::milliseconds(250);

scenes::Scene scene_of(const json& hello) {
  const auto file = hello.at("scene").get<std::string>();
  if (!file.empty()) return scenes::load_scene_with(file, hello.at("tool").get<std::string>());
  scenes::Scene none;
  none.name = "no scene";
  return none;
}

view::Stage stage_of(const json& hello) {
  const json& settings = hello.at("settings");
  return {description::load_cell(hello.at("cell").get<std::string>()),
          scene_of(hello),
          {.arm_alone = hello.at("arm_alone"),
           .period_s = settings.at("period_s"),
           .mass_kg = settings.at("mass_kg"),
           .damping_Ns_per_m = settings.at("damping_Ns_per_m"),
           .spring_N_per_m = settings.at("spring_N_per_m"),
           .impedance = settings.at("impedance")}};
}

view::ServerConfig server_of(const json& hello) {
  view::ServerConfig config{hello.at("port"), hello.at("allowed_origins")};
  for (const std::string& origin : config.allowed_origins) {
    if (view::is_origin(origin)) continue;
    throw description::SetupError({.key = "--allow-origin",
                                   .found = description::in_quotes(origin),
                                   .expected = "an origin as browsers send it, such as https://app.example.org"});
  }
  return config;
}

json settings_of(const view::PresentSettings& settings) {
  json places = json::array();
  for (const models::Vec3& p : settings.position_m) places.push_back({p.x(), p.y(), p.z()});
  return {{"period_s", settings.period_s},
          {"mass_kg", settings.mass_kg},
          {"damping_Ns_per_m", settings.damping_Ns_per_m},
          {"spring_N_per_m", settings.spring_N_per_m},
          {"friction", settings.friction},
          {"position_m", places}};
}

class LiveView {
 public:
  LiveView(boost::asio::io_context& context, stream_protocol::socket& session, const json& hello, int memory)
      : stage_(stage_of(hello)),
        source_(memory, stage_),
        control_(hello.at("control").get<std::string>(), context),
        page_(control_, [this](view::Socket& socket) { welcome(socket); }),
        tools_(stage_, source_.settings(), control_),
        server_(
            context, server_of(hello), page_files(),
            [this](const std::string& path) { return mesh_file(stage_, path); }, page_, &tools_),
        timer_(context),
        session_(session),
        context_(context) {}

  [[nodiscard]] std::string url() const { return server_.url(); }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }

  void run() {
    listen();
    timer_.expires_after(between_moments);
    show();
    context_.run();
  }

 private:
  // Lowers this process's priority when a waiting viewer has got the first picture, so that the session goes first if
  // processors are scarce.
  void step_back() {
    if (!std::exchange(stepped_back_, true)) (void)setpriority(PRIO_PROCESS, 0, 5);
  }

  void welcome(view::Socket& socket) {
    json stage = json::parse(stage_.describe());
    stage["mode"] = stage_.options().arm_alone ? "arm" : "live";
    stage["control"] = control_.open();
    stage["settings"] = settings_of(source_.settings());
    stage["threshold"] = threshold_json(threshold_);
    socket.say(text_of({{"stage", stage}}), false);
    socket.say(std::make_shared<const std::string>(view::encode_history(source_.history())), true);
    socket.say(text_of({{"status", status_}}), false);
    if (last_) socket.show(std::make_shared<const std::string>(source_.encode(*last_)));
    step_back();
  }

  void show() {
    timer_.async_wait([this](const error_code& error) {
      if (error) return;
      if (source_.advance()) {
        last_ = source_.take();
        tell_fault(view::fault_text(last_->record, stage_.cell()));
        tools_.show(*last_);
        if (source_.have_settings_changed()) page_.say(text_of({{"settings", settings_of(source_.settings())}}));
        if (!page_.empty()) {
          page_.show(std::make_shared<const std::string>(source_.encode(*last_)));
          tell_spectrum();
        }
      }
      // If the machine is too slow for 60 moments a second, fewer are shown, and no moments queue up.
      timer_.expires_at(std::max(timer_.expiry() + between_moments, std::chrono::steady_clock::now()));
      show();
    });
  }

  // Sends the spectrum four times a second at most: transforming a second of samples takes some milliseconds, and
  // nobody can read bars that change faster.
  void tell_spectrum() {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_spectrum_ || stage_.options().arm_alone) return;
    next_spectrum_ = now + between_spectra;
    const bool of_truth = last_->record.has(controller::RecordFlag::truth);
    page_.say(text_of({{"spectrum", spectrum_json(source_.spectrum(), of_truth, threshold_)}}));
  }

  void tell_fault(const std::string& text) {
    if (status_.at("fault") == text) return;
    status_["fault"] = text;
    page_.say(text_of({{"status", status_}}));
  }

  // Reads the session's lines after the first one, until the socket closes.
  void listen() {
    boost::asio::async_read_until(session_, lines_, '\n', [this](const error_code& error, std::size_t) {
      if (error) {
        status_["ended"] = "the session's program has ended";
        page_.say(text_of({{"status", status_}}));
        server_.stop();
        context_.stop();
        return;
      }
      std::istream in(&lines_);
      std::string line;
      std::getline(in, line);
      const json said = json::parse(line, nullptr, false);
      if (said.is_object()) status_.update(said);
      page_.say(text_of({{"status", status_}}));
      listen();
    });
  }

  view::Stage stage_;
  view::LiveSource source_;
  ControlLine control_;
  PageChannel page_;
  ToolChannel tools_;
  view::WebServer server_;
  boost::asio::steady_timer timer_;
  stream_protocol::socket& session_;
  boost::asio::io_context& context_;
  boost::asio::streambuf lines_{65536};
  json status_{{"fault", ""}, {"ended", ""}};
  std::optional<view::Moment> last_;
  assessment::VibrationThreshold threshold_ = vibration_threshold();
  std::chrono::steady_clock::time_point next_spectrum_{};
  bool stepped_back_ = false;
};

std::string first_line(stream_protocol::socket& session) {
  boost::asio::streambuf text(65536);
  boost::asio::read_until(session, text, '\n');
  std::istream in(&text);
  std::string line;
  std::getline(in, line);
  return line;
}

void reply(stream_protocol::socket& session, const json& answer) {
  boost::asio::write(session, boost::asio::buffer(*text_of(answer) + "\n"));
}

}  // namespace

int live_view(int memory, int session) {
  // Ctrl-C reaches both processes. Only the session obeys it; the session then ends this process.
  controller::ignore_ending_signals();
  boost::asio::io_context context{1};
  stream_protocol::socket line(context, stream_protocol(), session);
  std::optional<LiveView> shown;
  try {
    shown.emplace(context, line, json::parse(first_line(line)), memory);
    reply(line, {{"url", shown->url()}, {"port", shown->port()}, {"most_viewers", view::most_viewers}});
  } catch (const std::exception& error) {
    reply(line, {{"error", error.what()}});
    return 2;
  }
  shown->run();
  return 0;
}

}  // namespace proxarm::command_line

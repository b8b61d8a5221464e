#include "controller/command_line/sessions/session_output.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "controller/command_line/entry/exit_status.hpp"
#include "controller/command_line/sessions/view_process.hpp"
#include "controller/library/session_files.hpp"
#include "controller/library/session_summary.hpp"
#include "controller/preparation/effective_config.hpp"
#include "controller/preparation/session_loops.hpp"
#include "controller/report/terminal.hpp"
#include "models/arm/tool_space.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using controller::CycleRecord;
using controller::Summary;

constexpr const char* default_plot = "proxarm-run.svg";
// A force above empty_handle_N times this factor isn't from an empty handle, even while the tool rings.
constexpr double felt_bands = 4.0;

// Returns a text that says when the clocks of the scripts started; empty without a script.
std::string clocks_text(const Summary& summary, const controller::RunOptions& options) {
  if (options.faults.empty() && options.changes.empty() && options.orders.empty() && options.enabling.empty())
    return "";
  std::string text = "  clocks:                   --do and --enabling count from the first cycle";
  char line[96];
  if (summary.first_cycle_s) {
    std::snprintf(line, sizeof line, "; --fault from power on, %.3f s before it", *summary.first_cycle_s);
    text += line;
  }
  if (summary.rendering_from_s) {
    std::snprintf(line, sizeof line, "; --set from %.3f s after it, rendering time only", *summary.rendering_from_s);
    text += line;
  }
  return text + "\n";
}

}  // namespace

SessionOutput::SessionOutput(const controller::PreparedSession& session, const controller::RunOptions& options,
                             bool with_truth)
    : session_(session),
      options_(options),
      builder_(controller::summary_config(session)),
      progress_(session.duration_s),
      deriver_(session.cell) {
  controller::require_plot_file(options.plot_file);
  if (!session.impedance()) poses_ = std::make_unique<controller::LedPoses>(session, options, deriver_);
  swing_ = controller::slowest_swing(session);
  const bool wanted = !options.json || !options.plot_file.empty() || !options.record_dir.empty();
  if (options.plot && wanted) plot_ = std::make_unique<controller::PlotBuilder>(controller::plot_title(session));
  if (options.record_dir.empty()) return;
  writer_ = std::make_unique<controller::SessionWriter>(options.record_dir, controller::joint_names(session.cell),
                                                        with_truth, options.signals);
  writer_->write_file("effective.yaml", controller::effective_config(session));
}

namespace {
// Warns if the setpoints may make the gears ring. The stability check doesn't see this ringing.
void warn_if_it_chatters(const description::Cell& cell, double mode_Hz) {
  constexpr double most_modes = 3.0;  // measured (docs/results/studies.md)
  const double bandwidth_Hz = cell.limits.setpoint_bandwidth_Hz;
  if (!(bandwidth_Hz >= most_modes * mode_Hz)) return;
  std::fprintf(
      stderr,
      "proxarm: warning: limits.setpoint_bandwidth_Hz: found %.4g Hz, expected less than three times the arm's "
      "first mode (%.3g Hz here): gears ring under the setpoints, which the stability check doesn't see; a "
      "larger mass is calmer\n",
      bandwidth_Hz, mode_Hz);
}
}  // namespace

namespace {
// Returns a text that says how an arm of the admittance type with more or fewer than six axes moves; empty for six
// axes.
std::string axes_text(int axes, int dimensions) {
  if (axes == 6) return "";
  const std::string count = std::to_string(axes) + (axes == 1 ? " axis" : " axes");
  if (axes > 6) return count + ": place and orientation are held, and the elbow where it began\n";
  const char* ways[] = {"nowhere", "along a line", "in a plane", "in space"};
  const bool spare = axes > dimensions;
  return count + ": the tool moves " + ways[dimensions] + "; its orientation " +
         (spare ? "is held as far as they can\n" : "follows the arm\n");
}
}  // namespace

void SessionOutput::introduce() const {
  const models::Arm& arm = deriver_.arm();
  const double mode_Hz = arm.first_elastic_frequency_Hz(arm.start_rad());
  if (!session_.impedance()) warn_if_it_chatters(session_.cell, mode_Hz);
  if (options_.json) return;  // with --json only the summary goes to standard output
  const models::ToolSpace reach = models::tool_space(arm);
  const models::TipMass tip = arm.effective_mass_range(arm.start_rad(), reach.dimensions);
  std::printf("%s, scene %s: %s, T = %.4g ms, loop delay %.3g ms", session_.cell.name.c_str(),
              session_.scene.name.c_str(), controller::rendered_text(session_).c_str(),
              1e3 * session_.settings.period_s, 1e3 * controller::total_delay_s(session_));
  if (session_.settings.looks_ahead) std::printf(", lookahead %.3g ms", 1e3 * session_.settings.horizon_s);
  std::printf("\n");
  std::printf("the arm itself, without control: %.3g to %.3g kg at the tip", tip.min_kg, tip.max_kg);
  if (std::isfinite(mode_Hz)) std::printf(", first mode %.1f Hz", mode_Hz);
  std::printf("\n");
  if (swing_) {
    std::printf("led and turned at once, about here: a swing of %.1f Hz falls to a tenth within %.2f s\n",
                swing_->frequency_Hz, swing_->tenth_s);
  }
  if (!session_.impedance()) std::printf("%s", axes_text(arm.axes(), reach.dimensions).c_str());
  std::fflush(stdout);
}

// If the session holds or was stopped by a fault, prints on standard error how a pinned person gets free.
void SessionOutput::say_how_to_get_free(controller::Phase phase) const {
  const std::string& brakes = session_.cell.supervision.brake_release;
  const std::string by_hand = brakes.empty() ? "" : "; brakes: " + brakes;
  if (phase == controller::Phase::holding) {
    std::fprintf(stderr,
                 "proxarm: holding, drives enabled for %.3g s. Somebody pinned: `proxarm release` or `proxarm back-off "
                 "20mm`, with the enabling input pressed; to go on: press it anew, or `proxarm resume`%s\n",
                 session_.cell.supervision.hold_s, by_hand.c_str());
  } else if (phase == controller::Phase::faulted) {
    std::fprintf(stderr,
                 "proxarm: stopped by a fault, drives off. `proxarm reset` within %.3g s enables them again, into a "
                 "hold; somebody pinned: then `proxarm release`%s\n",
                 session_.settings.wait_after_fault_s, by_hand.c_str());
  }
}

// Prints on standard error whether the drives took a new timestep. The client who asked for the timestep was told only
// that the change began.
void SessionOutput::say_timestep(const CycleRecord& record) {
  if (record.refused_period_ns > 0) {
    std::fprintf(stderr,
                 "proxarm: timestep %.4g ms: %s; it stays %.4g ms, and changes of mass, damping and "
                 "spring that were scripted for it are left out (a new session with --timestep has its "
                 "drives told before they are enabled)\n",
                 1e-6 * static_cast<double>(record.refused_period_ns),
                 controller::refusal_text(record.timestep_refusal, controller::joint_names(session_.cell)).c_str(),
                 1e-6 * static_cast<double>(told_period_ns_));
  } else if (!record.has(controller::RecordFlag::timestep) && record.period_ns != told_period_ns_) {
    if (told_period_ns_ > 0) {
      std::fprintf(stderr, "proxarm: timestep %.4g ms from %.4g s on, all drives have confirmed it\n",
                   1e-6 * static_cast<double>(record.period_ns), 1e-9 * static_cast<double>(record.time_ns));
    }
    told_period_ns_ = record.period_ns;
  }
}

// Warns on standard error as it happens, once for each lasting spell.
void SessionOutput::say_oscillation() {
  const controller::Oscillation present = builder_.oscillation();
  if (present.lasts && !told_oscillation_) {
    std::fprintf(stderr,
                 "proxarm: the arm oscillates, %s and on: not stable with this hand; let go, or `proxarm hold`\n",
                 controller::oscillation_text(present).c_str());
  }
  told_oscillation_ = present.lasts;
}

// Warns on standard error if the session takes the handle for empty although a force is measured that a person could
// feel.
void SessionOutput::say_belief(const CycleRecord& record) {
  const bool off = record.has(controller::RecordFlag::hands_off);
  const double force_N = controller::vec3(record.force_W_N).norm();
  if (off && !was_off_ && !told_belief_ && force_N > felt_bands * session_.cell.supervision.empty_handle_N) {
    std::fprintf(
        stderr,
        "proxarm: nobody at the handle from %.4g s on, it is taken: %.2g N are as straight as a sensor's drift; "
        "if a hand or a load is there, --handle held\n",
        1e-9 * static_cast<double>(record.time_ns), force_N);
    told_belief_ = true;
  }
  was_off_ = off;
}

void SessionOutput::judge_pose(const CycleRecord& record) {
  if (!poses_) return;
  const bool were_late = poses_->samples_late();
  poses_->add(record);
  if (poses_->samples_late() && !were_late) say_lateness(record);
  if (record.phase != controller::Phase::rendering) return;
  if (options_.view_place) {
    for (const controller::PassedPoses::Place& place : poses_->places()) tell_margin(*options_.view_place, place);
  }
  say_poses();
}

// Warns on standard error once most samples have been late for a quarter of a second.
void SessionOutput::say_lateness(const CycleRecord& record) const {
  std::fprintf(stderr,
               "proxarm: from %.4g s on the force sensor's samples come a cycle late and are used %.4g ms later: the "
               "stability of the mass is judged with that; what delays them, or a longer --timestep?\n",
               1e-9 * static_cast<double>(record.time_ns), 1e-6 * static_cast<double>(record.period_ns));
}

// Reports on standard error the unstable places that the arm passed, because at the session's start only the start pose
// was judged. With --force-unstable nothing is reported, because the user knows that the mass is unstable.
void SessionOutput::say_poses() {
  for (const controller::UnstablePlaces& there : poses_->news()) {
    if (options_.force_unstable) continue;
    std::fprintf(stderr, "proxarm: %s; if it swings: a larger %s, or lead it elsewhere\n",
                 controller::poses_text(there).c_str(), there.lacks_mass ? "mass" : "inertia or mass");
  }
}

CycleRecord SessionOutput::add(const CycleRecord& record) {
  const auto begun = std::chrono::steady_clock::now();
  CycleRecord completed = record;
  if (record.phase == controller::Phase::rendering) rendered_ns_ += record.period_ns;
  controller::complete(completed, session_, rendered_ns_);
  tell(completed);
  spent_ += std::chrono::steady_clock::now() - begun;
  return completed;
}

void SessionOutput::tell(const CycleRecord& record) {
  // A hold that is needed to change the timestep isn't reported, because it ends by itself. If the hold goes on when
  // the change is over, it is reported.
  if (record.phase != controller::Phase::holding || !record.has(controller::RecordFlag::timestep)) {
    if (record.phase != last_phase_) say_how_to_get_free(record.phase);
    last_phase_ = record.phase;
  }
  say_timestep(record);
  builder_.add(record);
  say_oscillation();
  say_belief(record);
  judge_pose(record);
  if (writer_) writer_->add(record, deriver_.derive(record));
  if (plot_) plot_->add(record);
  if (progress_.enabled()) {
    const bool rendering = record.phase == controller::Phase::rendering;
    const char* what =
        rendering ? controller::contact_phase_name(record.contact) : controller::phase_name(record.phase);
    progress_.update(static_cast<double>(record.time_ns) * 1e-9, told_oscillation_ ? "OSCILLATES" : what);
  }
}

void SessionOutput::add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (writer_) writer_->add_frame(bus, frame, time_ns);
}

Summary SessionOutput::summary(const controller::Cycle& cycle, controller::SessionEnd end,
                               const controller::EndingCause& cause) {
  Summary summary =
      controller::session_summary(builder_, cycle, end, {.reason = cause.word, .text = cause.text}, session_);
  summary.figures_s = std::chrono::duration<double>(spent_).count();
  summary.expected_swing = swing_;
  if (poses_) {
    summary.poses = poses_->summary();
    say_poses();
  }
  controller::add_idle_orders(summary, cycle, options_);
  return summary;
}

int SessionOutput::finish(Summary summary, BlackBoxKeeper& keeper) {
  progress_.clear();
  const bool ended_by_fault = summary.ended_by_fault();
  if (options_.view_place) {
    summary.view = {options_.view_place->port, options_.view_place->most_viewers, options_.view_control};
  }
  if (keeper.finish(ended_by_fault ? summary.faults.back().text : "")) summary.black_box = keeper.folder().string();
  if (options_.json) {
    std::printf("%s\n", controller::summary_json(summary).c_str());
  } else {
    const controller::SummaryLook look{.verbose = options_.verbose, .colour = controller::shows_colour(stdout)};
    std::printf("%s%s", controller::summary_text(summary, look).c_str(), clocks_text(summary, options_).c_str());
  }
  std::fflush(stdout);
  const bool drawn = draw_plot(summary);
  if (writer_) writer_->finish(summary);
  if (ended_by_fault) {
    if (!options_.json && !summary.black_box.empty()) {
      std::printf("  black box:                %s\n", summary.black_box.c_str());
    }
    return fault_ended_the_run;
  }
  if (!drawn && !options_.plot_file.empty()) return set_up_mistake;
  return summary.oscillation && summary.oscillation->lasts ? fault_ended_the_run : fine;
}

bool SessionOutput::draw_plot(const Summary& summary) {
  if (!plot_) return true;
  if (plot_->is_empty()) {  // the session ended before rendering
    if (!options_.json) std::printf("  plot:                     none; nothing was rendered\n");
    return true;
  }
  fs::path file = options_.plot_file;
  if (file.empty()) file = options_.record_dir.empty() ? fs::path(default_plot) : options_.record_dir / "plot.svg";
  const std::string warning = plot_->write(file, controller::plot_headline(summary));
  if (!warning.empty()) {
    std::fprintf(stderr, "proxarm: %s\n", warning.c_str());
  } else if (!options_.json) {
    std::printf("  plot:                     %s\n", file.c_str());
  }
  return warning.empty();
}

}  // namespace proxarm::command_line

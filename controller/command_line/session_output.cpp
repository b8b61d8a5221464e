#include "controller/command_line/session_output.hpp"

#include <cstdio>

#include "controller/command_line/effective_config.hpp"
#include "scenes/compile.hpp"

namespace proxarm::command_line {
namespace {

controller::SummaryConfig summary_config(const PreparedSession& session) {
  controller::SummaryConfig config;
  config.period_s = session.settings.period_s;
  config.felt_mass_kg = session.settings.mass_kg;
  config.handle_mass_kg = session.cell.tool.mass_kg;
  config.damping_Ns_per_m = session.settings.damping_Ns_per_m;
  config.spring_N_per_m = session.settings.spring_N_per_m;
  return config;
}

std::vector<std::string> joint_names(const description::Cell& cell) {
  std::vector<std::string> names;
  for (const description::DriveDescription& drive : cell.drives) names.push_back(drive.joint);
  return names;
}

// Where the plot goes: as asked; with a record into its folder; else beside the user, but not under a program that
// reads JSON.
std::filesystem::path plot_file(const RunOptions& options) {
  if (!options.plot) return {};
  if (!options.plot_file.empty()) return options.plot_file;
  if (!options.record_dir.empty()) return options.record_dir / "plot.svg";
  return options.json ? std::filesystem::path() : std::filesystem::path("proxarm-run.svg");
}

std::string plot_title(const PreparedSession& session) {
  char text[200];
  std::snprintf(text, sizeof text, "%s, %.4g kg, T = %.4g ms", session.scene.name.c_str(), session.settings.mass_kg,
                1e3 * session.settings.period_s);
  return text;
}

}  // namespace

SessionOutput::SessionOutput(const PreparedSession& session, const RunOptions& options, bool with_truth)
    : session_(session), options_(options), builder_(summary_config(session)), progress_(session.duration_s) {
  if (!plot_file(options).empty()) plot_.emplace(plot_title(session));
  if (options.record_dir.empty()) return;
  writer_ = std::make_unique<controller::SessionWriter>(options.record_dir, joint_names(session.cell), with_truth);
  writer_->write_file("effective.yaml", effective_config(session));
}

void SessionOutput::add(controller::CycleRecord record) {
  using controller::RecordFlag;
  const auto& tool = record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m;
  record.proxy_clearance_m = scenes::clearance_m(session_.scene, controller::vec3(record.proxy_W_m));
  record.tool_clearance_m = scenes::clearance_m(session_.scene, controller::vec3(tool));
  const auto object = static_cast<std::size_t>(record.contact_object);
  if (record.contact_object >= 0 && object < session_.scene.objects.size()) {
    record.friction = session_.scene.objects[object].friction;
  }
  builder_.add(record);
  if (writer_) writer_->add(record);
  if (plot_) plot_->add(record);
  if (record.phase == controller::Phase::rendering && progress_.enabled()) show_progress(record);
}

void SessionOutput::show_progress(const controller::CycleRecord& record) {
  if (begun_ns_ < 0) begun_ns_ = record.time_ns;
  char note[64];
  std::snprintf(note, sizeof note, "%s, hand %.1f N", controller::contact_phase_name(record.contact),
                controller::vec3(record.force_W_N).norm());
  progress_.update(1e-9 * static_cast<double>(record.time_ns - begun_ns_), note);
}

void SessionOutput::add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (writer_) writer_->add_frame(bus, frame, time_ns);
}

void SessionOutput::finish(const controller::Summary& summary) {
  progress_.clear();
  if (writer_) writer_->finish(summary);
  std::string drawn;
  if (plot_) {
    const std::filesystem::path file = plot_file(options_);
    const std::string warning = plot_->write(file);
    if (!warning.empty()) std::fprintf(stderr, "warning: %s\n", warning.c_str());
    if (warning.empty()) drawn = file.string();
  }
  if (options_.json) {
    std::printf("%s\n", controller::summary_json(summary).c_str());
  } else {
    std::printf("%s", controller::summary_text(summary).c_str());
    if (!drawn.empty()) std::printf("  plot:                     %s\n", drawn.c_str());
    if (writer_) std::printf("  record:                   %s\n", writer_->folder().string().c_str());
  }
  std::fflush(stdout);
}

}  // namespace proxarm::command_line

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
  return config;
}

std::vector<std::string> joint_names(const description::Cell& cell) {
  std::vector<std::string> names;
  for (const description::DriveDescription& drive : cell.drives) names.push_back(drive.joint);
  return names;
}

}  // namespace

SessionOutput::SessionOutput(const PreparedSession& session, const RunOptions& options, bool with_truth)
    : session_(session), options_(options), builder_(summary_config(session)) {
  if (options.record_dir.empty()) return;
  writer_ = std::make_unique<controller::SessionWriter>(options.record_dir, joint_names(session.cell), with_truth);
  writer_->write_file("effective.yaml", effective_config(session));
}

void SessionOutput::add(controller::CycleRecord record) {
  using controller::RecordFlag;
  const auto& tool = record.has(RecordFlag::truth) ? record.true_tool_W_m : record.tool_W_m;
  record.proxy_clearance_m = scenes::clearance_m(session_.scene, controller::vec3(record.proxy_W_m));
  record.tool_clearance_m = scenes::clearance_m(session_.scene, controller::vec3(tool));
  builder_.add(record);
  if (writer_) writer_->add(record);
  if (options_.plot && record.phase == controller::Phase::rendering) rendered_.push_back(record);
}

void SessionOutput::add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (writer_) writer_->add_frame(bus, frame, time_ns);
}

void SessionOutput::finish(const controller::Summary& summary) {
  if (writer_) writer_->finish(summary);
  if (options_.json) {
    std::printf("%s\n", controller::summary_json(summary).c_str());
  } else {
    std::printf("%s", controller::summary_text(summary).c_str());
  }
  std::fflush(stdout);
}

}  // namespace proxarm::command_line

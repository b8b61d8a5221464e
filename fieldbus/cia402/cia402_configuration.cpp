// The configuration of a CiA 402 drive before the cycle starts, and texts about the drive's problems.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sdo_abort.hpp"
#include "fieldbus/canopen/canopen_sync.hpp"
#include "fieldbus/cia402/cia402_drive.hpp"
#include "fieldbus/cia402/eds_check.hpp"
#include "models/description/homing.hpp"

namespace proxarm::fieldbus {
namespace {

using description::number_text;
using description::SetupError;

constexpr std::uint32_t servo_drive = 0x00020192;       // value of 1000h: CiA 402, servo drive
constexpr std::int64_t mode_patience_ns = 500'000'000;  // how long 6061h may take to show the mode written to 6060h

constexpr const char* period_advice =
    "take a period of one to three digits of microseconds or milliseconds, such as 0.5ms, 1ms, 2ms, 4ms";

// Returns the session's settings, with the timeouts that the cell sets for this drive.
DriveSettings settings_of(const description::DriveDescription& drive, DriveSettings settings) {
  settings.validate();
  const auto to_ns = [](double seconds) { return std::llround(1e9 * seconds); };
  const description::BringUp usual;
  if (drive.bring_up.start_timeout_s != usual.start_timeout_s) {
    settings.nmt_timeout_ns = settings.sdo.first_answer_ns = to_ns(drive.bring_up.start_timeout_s);
  }
  if (drive.bring_up.answer_timeout_s != usual.answer_timeout_s) {
    settings.sdo.client.timeout_ns = to_ns(drive.bring_up.answer_timeout_s);
  }
  return settings;
}

std::string period_text(std::int64_t period_ns) { return number_text(static_cast<double>(period_ns) * 1e-6) + " ms"; }

[[noreturn]] void refuse(const description::DriveDescription& drive, const std::string& key, std::string found,
                         std::string expected) {
  throw SetupError({.bus = drive.bus,
                    .node = drive.node,
                    .key = "drive of " + drive.joint + ": " + key,
                    .found = std::move(found),
                    .expected = std::move(expected)});
}

std::uint16_t rpdo_timeout_ms(const DriveSettings& settings, std::int64_t period_ns, bool torque) noexcept {
  if (torque) return static_cast<std::uint16_t>(period_ns * settings.torque_timeout_periods / 1'000'000);
  const std::int64_t timeout_ns = period_ns * settings.rpdo_timeout_periods;
  return static_cast<std::uint16_t>((timeout_ns + 999'999) / 1'000'000);
}

std::uint32_t as_u8(std::int8_t value) noexcept { return static_cast<std::uint8_t>(value); }

bool is_skipped(const description::BringUp& bring_up, const SdoStep& step) noexcept {
  return std::any_of(bring_up.skip.begin(), bring_up.skip.end(),
                     [&](std::uint32_t object) { return step.object == object_address(object); });
}

void append(std::vector<SdoStep>& steps, const std::vector<SdoStep>& more) {
  steps.insert(steps.end(), more.begin(), more.end());
}

void append_identity(std::vector<SdoStep>& steps, const description::DriveDescription& drive) {
  // This first step also shows whether a node with this number exists.
  steps.push_back(
      sdo_expect({0x1000, 0}, 4, drive.device_type.value_or(servo_drive), "device type",
                 "is another device set to this node, or is device_type in the cell's file not this drive's?"));
  steps.push_back(sdo_read({0x1018, 1}, 4, "vendor-ID"));
  steps.push_back(if_present(sdo_read({0x1018, 2}, 4, "product code")));
  steps.push_back(if_present(sdo_read({0x1018, 3}, 4, "revision number")));
  steps.push_back(if_present(sdo_read({0x1018, 4}, 4, "serial number")));
  const CyclicMode& mode = mode_of(drive);
  const std::uint32_t supported = 1U << (mode.number - 1);
  steps.push_back(sdo_expect(object_address(drive.objects.supported_modes), 4, supported, "supported drive modes",
                             mode.unsupported, supported));
}

// Appends the steps for PDO 1 in both directions. All other PDOs are disabled first, so that only the cycle's PDOs load
// the bus.
void append_pdos(std::vector<SdoStep>& steps, const description::DriveDescription& drive, std::uint16_t timeout_ms,
                 std::uint32_t inputs_object, bool torque_feedback) {
  const std::uint8_t node = drive.node;
  for (std::uint8_t number = 2; number <= 4; ++number) {
    steps.push_back(disable_pdo_step(PdoDirection::receive, number, node));
    steps.push_back(disable_pdo_step(PdoDirection::transmit, number, node));
  }
  append(steps, pdo_steps({.direction = PdoDirection::receive,
                           .number = 1,
                           .id = pdo_id(PdoDirection::receive, 1, node),
                           .transmission_type = every_sync,
                           .event_timer_ms = timeout_ms,
                           .fd = drive.fd,
                           .mapping = rpdo_mapping(drive)}));
  // In torque mode, the last torque acts until the RPDO timer runs out. Without the timer it would act until the
  // heartbeat timeout. For a drive with `stops_by: setpoint_timer`, the timer is the only means that stops it. In both
  // cases the timer is required.
  if (mode_of(drive).torque || drive.bring_up.stops_by == description::StopsBy::setpoint_timer) {
    for (SdoStep& step : steps) {
      if (step.object == ObjectAddress{0x1400, 5}) step.is_optional = false;
    }
  }
  append(steps, pdo_steps({.direction = PdoDirection::transmit,
                           .number = 1,
                           .id = pdo_id(PdoDirection::transmit, 1, node),
                           .transmission_type = every_sync,
                           .event_timer_ms = 0,
                           .fd = drive.fd,
                           .mapping = tpdo_mapping(drive, torque_feedback)}));
  if (inputs_object == 0) return;
  append(steps, pdo_steps({.direction = PdoDirection::transmit,
                           .number = 2,
                           .id = pdo_id(PdoDirection::transmit, 2, node),
                           .transmission_type = every_sync,
                           .event_timer_ms = 0,
                           .mapping = {{object_address(inputs_object), 32}}}));
}

// Appends the steps by which the drive itself limits torque and speed to the cell's values. 6076h is the rated torque
// of the motor before the gear, in mNm.
void append_torque(std::vector<SdoStep>& steps, const description::DriveDescription& drive) {
  const auto rated_mNm = static_cast<std::uint32_t>(std::llround(1e3 * drive.rated_torque_Nm / drive.gear_ratio));
  const auto most = static_cast<std::uint32_t>(std::llround(1e3 * drive.max_torque_Nm / drive.rated_torque_Nm));
  const double rpm = 60.0 / (2.0 * std::numbers::pi) * drive.max_speed_rad_per_s * drive.gear_ratio;
  SdoStep rated = sdo_expect({0x6076, 0}, 4, rated_mNm, "motor rated torque (mNm)",
                             "is rated_torque_Nm in the cell's file this motor's, times its gear_ratio?");
  rated.is_state = true;  // the motor's data are entered in the drive at set-up
  steps.push_back(if_present(rated));
  steps.push_back(sdo_write({0x6072, 0}, 2, most, "max torque"));
  steps.push_back(if_present(sdo_write({0x6080, 0}, 4, static_cast<std::uint32_t>(std::ceil(rpm)), "max motor speed")));
}

// Makes the drive watch the controller's heartbeat. The watch is first switched off: a drive that still watched for the
// last session's controller would trip during this set-up.
void append_heartbeat(std::vector<SdoStep>& steps, std::uint32_t consumer) {
  for (const std::uint32_t value : {0U, consumer}) {
    SdoStep step = sdo_write({0x1016, 1}, 4, value, "consumer heartbeat time (of the controller)");
    step.advice =
        "by this the drive stops when the controller is gone; where life guarding (100Ch) or its setpoint timer "
        "(1400h:05) does, say bring_up: {stops_by: life_guarding} or {stops_by: setpoint_timer} at the drive in the "
        "cell, and try it: proxarm prove --bus-loss";
    steps.push_back(step);
  }
}

// Makes the drive watch the controller by life guarding (CiA 301). The drive stops if its state isn't requested for
// guard time × life time factor.
void append_life_guarding(std::vector<SdoStep>& steps, const DriveSettings& settings) {
  for (const std::uint32_t time_ms : {0U, std::uint32_t{settings.master_heartbeat_ms}}) {
    steps.push_back(sdo_write({0x100C, 0}, 2, time_ms, "guard time (of the controller)"));
  }
  steps.push_back(sdo_write({0x100D, 0}, 1, settings.life_time_factor(), "life time factor"));
}

// Appends the writes of the cell's `bring_up`. The drive needs these values before its PDOs are mapped.
void append_start_up(std::vector<SdoStep>& steps, const description::BringUp& bring_up) {
  for (const description::StartUpWrite& write : bring_up.write) {
    steps.push_back(sdo_write(object_address(write.object), static_cast<std::uint8_t>(write.bits / 8), write.value,
                              "start-up value (bring_up)"));
  }
}

// Appends the drive's reactions to a lost controller and to stop commands. The object that stops the drive when the
// controller dies is required: 1016h, or 100Ch with `stops_by: life_guarding`. The other objects are optional, because
// their defaults in the standard stop the arm too.
void append_reactions(std::vector<SdoStep>& steps, const DriveSettings& settings,
                      const description::BringUp& bring_up) {
  if (bring_up.stops_by == description::StopsBy::heartbeat) append_heartbeat(steps, settings.consumer_heartbeat());
  if (bring_up.stops_by == description::StopsBy::life_guarding) append_life_guarding(steps, settings);
  steps.push_back(sdo_write({0x1017, 0}, 2, settings.drive_heartbeat_ms, "producer heartbeat time"));
  steps.push_back(if_present(sdo_write({0x1029, 1}, 1, 0, "error behaviour (communication error: pre-operational)")));
  // If the maker has fixed this option, fault (1) and disable voltage (2) are accepted, because they stop the arm too.
  // No action (0) is refused.
  steps.push_back(or_found(if_present(sdo_write({0x6007, 0}, 2, 3, "abort connection option code (quick stop)"),
                                      "how it stops without the controller is its own affair"),
                           {3, 1, 2}));
  steps.push_back(if_present(sdo_write({0x605A, 0}, 2, 2, "quick stop option code (quick-stop ramp, then disabled)")));
  steps.push_back(if_present(sdo_write({0x605B, 0}, 2, 1, "shutdown option code (slow down, then disable)")));
  steps.push_back(if_present(sdo_write({0x605C, 0}, 2, 1, "disable operation option code (slow down, then disable)")));
  steps.push_back(if_present(sdo_write({0x605D, 0}, 2, 1, "halt option code (slow down on ramp)")));
  steps.push_back(if_present(sdo_write({0x605E, 0}, 2, 2, "fault reaction option code (quick-stop ramp)")));
}

}  // namespace

std::vector<SdoStep> ServoDrive::operation_steps() const {
  if (settings_.heartbeat_in_operation) return {};
  return {sdo_write({0x1017, 0}, 2, 0, "producer heartbeat time")};
}

PeriodSteps ServoDrive::period_steps(std::int64_t from_ns, std::int64_t to_ns) const noexcept {
  const auto from = interpolation_period(from_ns).value_or(InterpolationPeriod{}),
             to = interpolation_period(to_ns).value_or(InterpolationPeriod{});
  PeriodStep value{object_address(description_.objects.interpolation_value), 1, to.units, from.units};
  PeriodStep index{object_address(description_.objects.interpolation_index), 1, as_u8(to.exponent),
                   as_u8(from.exponent)};
  // Between the two writes the drive has an interim period: to.units · 10^from.exponent if the value is written first,
  // from.units · 10^to.exponent if the exponent is written first. The longer interim period is chosen.
  const bool value_first = to.units * std::pow(10.0, from.exponent) >= from.units * std::pow(10.0, to.exponent);
  const PeriodStep sync{{0x1006, 0}, 4, sync_period_us(to_ns).value_or(0), sync_period_us(from_ns).value_or(0), true};
  const PeriodStep timer{{0x1400, 5},
                         2,
                         rpdo_timeout_ms(settings_, to_ns, mode_.torque),
                         rpdo_timeout_ms(settings_, from_ns, mode_.torque),
                         true};
  return {value_first ? value : index, value_first ? index : value, sync, timer};
}

void DriveSettings::stop_without_controller(double within_s) noexcept {
  master_heartbeat_timeout_ms = static_cast<std::uint16_t>(std::lround(std::floor(1e3 * within_s + 1e-6)));
  master_heartbeat_ms = static_cast<std::uint16_t>(master_heartbeat_timeout_ms / 3);
}

void DriveSettings::validate() const {
  const auto refuse_setting = [](const char* key, std::string found, std::string expected, std::string advice = "") {
    throw SetupError(
        {.key = key, .found = std::move(found), .expected = std::move(expected), .advice = std::move(advice)});
  };
  if (!interpolation_period(period_ns) || !sync_period_us(period_ns)) {
    refuse_setting(
        "timestep", period_text(period_ns),
        "a period that the drives can hold exactly: 1..255 times a power of ten of seconds (60C2h) and whole "
        "microseconds (1006h)",
        period_advice);
  }
  if (master_node < 1 || master_node > 127) refuse_setting("master_node", std::to_string(master_node), "1 to 127");
  if (master_heartbeat_ms < 1 || master_heartbeat_timeout_ms <= master_heartbeat_ms) {
    refuse_setting("master_heartbeat_timeout_ms", std::to_string(master_heartbeat_timeout_ms),
                   "more than the heartbeat's own " + std::to_string(master_heartbeat_ms) + " ms");
  }
  constexpr std::uint16_t usual_timeout_ms = 60;
  if (master_heartbeat_timeout_ms < usual_timeout_ms && master_heartbeat_timeout_ms * 1'000'000LL < 3 * period_ns) {
    refuse_setting("supervision.bus_loss_stop_s", number_text(1e-3 * master_heartbeat_timeout_ms) + " s",
                   "at least three timesteps: the heartbeat is sent by the cycle");
  }
  if (drive_heartbeat_ms < 1 || drive_heartbeat_timeout_ms <= drive_heartbeat_ms) {
    refuse_setting("drive_heartbeat_timeout_ms", std::to_string(drive_heartbeat_timeout_ms),
                   "more than the heartbeat's own " + std::to_string(drive_heartbeat_ms) + " ms");
  }
  if (rpdo_timeout_periods < 2 || period_ns * rpdo_timeout_periods > 65'535'000'000) {
    refuse_setting("rpdo_timeout_periods", std::to_string(rpdo_timeout_periods),
                   "2 or more, and at most 65.535 s in all");
  }
  if (!(following_error_window_rad > 0.0)) {
    refuse_setting("following_error_window_rad", number_text(following_error_window_rad), "more than 0 rad");
  }
}

ServoDrive::ServoDrive(const description::DriveDescription& drive, const DriveSettings& settings)
    : description_(drive),
      settings_(settings_of(drive, settings)),
      mode_(mode_of(drive)),
      tpdo_bytes_(pdo_bytes(tpdo_mapping(drive))),
      rpdo_bytes_(pdo_bytes(rpdo_mapping(drive))),
      torque_feedback_(mode_.torque),
      torque_byte_(extra_torque_byte(drive)),
      mode_byte_(mode_display_byte(drive)),
      gear_torque_byte_(gear_torque_byte(drive)),
      scale_(drive),
      heartbeat_(drive.node, std::int64_t{settings.drive_heartbeat_timeout_ms} * 1'000'000) {
  if (drive.node < 1 || drive.node > 127) refuse(drive, "node", std::to_string(drive.node), "1 to 127");
  if (drive.node == settings.master_node) {
    refuse(drive, "node", std::to_string(drive.node), "a number other than the controller's own");
  }
  if (drive.profile != "cia402") refuse(drive, "profile", description::in_quotes(drive.profile), "cia402");
  if (drive.mode != mode_.name) refuse(drive, "mode", description::in_quotes(drive.mode), "csp, ip or cst");
  if (mode_.torque) set_up_torque();
  if (!scale_.size_counts(settings.following_error_window_rad)) {
    refuse(drive, "following_error_window_rad", number_text(settings.following_error_window_rad),
           "a window whose counts fit 32 bits");
  }
  note_skipped();
  if (drive.eds.empty()) return;
  eds_ = std::make_shared<description::EdsFile>(description::load_eds(drive.eds));
  if (!description_.device_type) description_.device_type = cia402_device_type(*eds_);
  leave_out_what_eds_lacks();
  EdsLosses losses;
  (void)steps_by_eds(profile_steps(), *eds_, description_, &losses);  // called for the losses and SetupErrors
  losses_.insert(losses_.end(), losses.missing.begin(), losses.missing.end());
  fixed_by_eds_ = losses.fixed;
}

// True for the cell's `gear_torque`. This feedback must not be left out, because stability was judged with it.
bool ServoDrive::is_gear_torque(const MappedObject& object) const noexcept {
  return description_.gear_torque && object.object == object_address(description_.gear_torque->object);
}

void ServoDrive::leave_out_what_eds_lacks() {
  for (const MappedObject& object : tpdo_mapping(description_)) {
    const bool is_needed = object.object == object_address(description_.objects.statusword) ||
                           object.object == object_address(description_.objects.position) || is_gear_torque(object);
    if (!is_needed && !can_send(*eds_, object)) lose_feedback(object);
  }
}

void ServoDrive::lose_feedback(const MappedObject& object) {
  const bool is_torque = object.object == object_address(description_.objects.torque);
  if (is_torque) torque_feedback_ = false;
  std::erase_if(description_.feedback, [&](const description::DriveFeedback& feedback) {
    return object_address(feedback.object) == object.object;
  });
  tpdo_bytes_ = pdo_bytes(tpdo_mapping(description_, torque_feedback_));
  torque_byte_ = extra_torque_byte(description_);
  mode_byte_ = mode_display_byte(description_, torque_feedback_);
  gear_torque_byte_ = gear_torque_byte(description_);
  const char* name = is_torque ? "no torque feedback" : "no such feedback in the record";
  losses_.push_back("no " + to_string(object.object) + " in its TPDO: " + name);
}

bool ServoDrive::give_up_feedback(const SdoStep& failed, std::uint32_t abort_code) {
  constexpr std::uint32_t refusals[] = {sdo_abort::object_missing, sdo_abort::sub_index_missing,
                                        sdo_abort::not_mappable};
  if (std::find(std::begin(refusals), std::end(refusals), abort_code) == std::end(refusals)) return false;
  const auto mapping = tpdo_mapping(description_, torque_feedback_);
  constexpr std::uint16_t first_transmit_mapping = 0x1A00;
  if (failed.object.index != first_transmit_mapping || failed.object.sub <= 2) return false;
  if (failed.object.sub > mapping.size() || is_gear_torque(mapping[failed.object.sub - 1U])) return false;
  lose_feedback(mapping[failed.object.sub - 1U]);
  return true;
}

void ServoDrive::note_losses(const std::vector<std::string>& losses) {
  fixed_by_eds_.clear();
  for (const std::string& loss : losses) {
    if (std::find(losses_.begin(), losses_.end(), loss) == losses_.end()) losses_.push_back(loss);
  }
}

std::vector<std::string> ServoDrive::losses() const {
  std::vector<std::string> all = losses_;
  if (!fixed_by_eds_.empty()) {
    all.push_back("can't be written by its file and taken as found, because it fits: " + fixed_by_eds_);
  }
  return all;
}

// Prepares torque mode. 6071h holds the torque in thousandths of the rated torque, as a 16-bit number, so at most
// 32.767 times the rated torque.
void ServoDrive::set_up_torque() {
  if (!(description_.rated_torque_Nm > 0.0)) {
    refuse(description_, "rated_torque_Nm", number_text(description_.rated_torque_Nm), "more than 0 Nm");
  }
  constexpr double most = 32.767;
  if (!(description_.max_torque_Nm > 0.0 && description_.max_torque_Nm <= most * description_.rated_torque_Nm)) {
    refuse(description_, "max_torque_Nm", number_text(description_.max_torque_Nm),
           "more than 0 and at most 32.767 times rated_torque_Nm");
  }
  torque_per_Nm_ = description_.direction * 1e3 / description_.rated_torque_Nm;
  if (rpdo_timeout_ms(settings_, settings_.period_ns, true) < 1) {
    throw SetupError({.key = "timestep",
                      .found = period_text(settings_.period_ns),
                      .expected =
                          "at least 0.334 ms in torque mode: the drive must give up the last torque within three "
                          "periods, and counts them in whole milliseconds (1400h:05)"});
  }
}

std::vector<SdoStep> ServoDrive::configuration_steps() const {
  return eds_ ? steps_by_eds(profile_steps(), *eds_, description_) : profile_steps();
}

std::vector<SdoStep> ServoDrive::profile_steps() const {
  std::vector<SdoStep> steps = all_profile_steps();
  std::erase_if(steps, [this](const SdoStep& step) { return is_skipped(description_.bring_up, step); });
  return steps;
}

// Notes as losses the steps that the cell skips. Throws SetupError if a skipped step isn't optional.
void ServoDrive::note_skipped() {
  const std::vector<SdoStep> steps = all_profile_steps();
  for (const std::uint32_t object : description_.bring_up.skip) {
    const auto step = std::find_if(steps.begin(), steps.end(),
                                   [object](const SdoStep& s) { return s.object == object_address(object); });
    const std::string name = to_string(object_address(object));
    if (step == steps.end() || !step->is_optional) {
      refuse(description_, "bring_up: skip",
             name + (step == steps.end() ? ", which isn't touched" : ", which is a must"),
             "an optional object of the set-up, such as 1029h:01 or 605Ah");
    }
    losses_.push_back(name + " isn't touched (bring_up: skip): " +
                      (*step->lost != '\0' ? step->lost : "the drive has its own " + std::string(step->name)));
  }
}

std::vector<SdoStep> ServoDrive::all_profile_steps() const {
  const auto period = *interpolation_period(settings_.period_ns);
  std::vector<SdoStep> steps;
  append_identity(steps, description_);
  if (description_.homing) {
    SdoStep homed =
        sdo_expect({description::homed_index, description::homed_subindex}, 4, description::homed_token(description_),
                   "configuration date",
                   "its encoder is incremental, and it wasn't homed since power on: proxarm calibrate --home");
    homed.is_state = true;
    steps.push_back(homed);
  }
  append_start_up(steps, description_.bring_up);
  append_pdos(steps, description_, rpdo_timeout_ms(settings_, settings_.period_ns, mode_.torque),
              settings_.inputs_object, torque_feedback_);
  // A drive may have fixed the value or the exponent of 60C2h. A fixed number is accepted if it is the needed one.
  steps.push_back(or_found(sdo_write(object_address(description_.objects.interpolation_value), 1, period.units,
                                     "interpolation time period value"),
                           {period.units}));
  steps.push_back(or_found(sdo_write(object_address(description_.objects.interpolation_index), 1,
                                     as_u8(period.exponent), "interpolation time index"),
                           {as_u8(period.exponent)}));
  steps.push_back(
      if_present(sdo_write({0x1006, 0}, 4, *sync_period_us(settings_.period_ns), "communication cycle period")));
  append_reactions(steps, settings_, description_.bring_up);
  // The deceleration on quick stop and on slow down, in counts/s² (the profile's default unit).
  if (const auto ramp = scale_.size_counts(description_.max_acceleration_rad_per_s2); ramp && *ramp > 0) {
    steps.push_back(if_present(sdo_write({0x6084, 0}, 4, *ramp, "profile deceleration")));
    steps.push_back(if_present(sdo_write({0x6085, 0}, 4, *ramp, "quick stop deceleration")));
  }
  steps.push_back(if_present(
      sdo_write({0x6065, 0}, 4, *scale_.size_counts(settings_.following_error_window_rad), "following error window"),
      "it has no such window of its own, so only the controller watches whether it follows"));
  steps.push_back(if_present(sdo_write({0x6066, 0}, 2, settings_.following_error_time_ms, "following error time out")));
  if (mode_.torque) append_torque(steps, description_);
  steps.push_back(or_found(sdo_write(object_address(description_.objects.mode), 1, mode_.number, "modes of operation"),
                           {mode_.number}));
  if (description_.bring_up.shows_mode_enabled) return steps;  // the cycle watches the mode in TPDO1
  SdoStep display = sdo_expect(object_address(description_.objects.mode_display), 1, mode_.number,
                               "modes of operation display", mode_.not_taken);
  display.is_state = true;
  display.patience_ns = mode_patience_ns;
  steps.push_back(display);
  return steps;
}

// Says in which state the drive stayed when enabling was abandoned, and what the user should look for.
std::string ServoDrive::stuck_text() const {
  const auto word = static_cast<std::uint16_t>(stuck_);
  const DriveState state = decode_state(word);
  std::string text = "it stayed in " + std::string(to_string(state)) + " (statusword " + hex_text(word, 4) + "): ";
  switch (state) {
    case DriveState::not_ready_to_switch_on:
      return text + "it is still starting up, or its firmware waits for something; look at its display";
    case DriveState::switch_on_disabled:
      return text +
             "its power stage is kept off; is STO closed (E-stop released, safety relay on), is the power supply " +
             "on" + ((word & statusword::voltage_enabled) == 0 ? " (bit 4 says: no voltage)" : "") +
             ", is its hardware enable input set?";
    case DriveState::ready_to_switch_on:
      return text + "it doesn't take `switch on`; is the main contactor closed and the DC link charged?";
    case DriveState::switched_on:
      return text +
             "it doesn't take `enable operation`; look at its display: mode, interpolation period and SYNC, and "
             "its hardware enable input";
    case DriveState::operation_enabled:
      break;
    default:
      return text + "look at its display and its error list (1003h)";
  }
  if (mode_byte_ && shown_mode_ != mode_.number) {
    return text + "6061h shows mode " + std::to_string(shown_mode_) + " and not " + std::to_string(mode_.number);
  }
  return text +
         "it is enabled, but never says that it follows its targets (bit 12 of the statusword); a slow brake wants "
         "`bring_up: {enable_timeout_s: ...}` in the cell";
}

std::string ServoDrive::describe() const {
  std::string text = "drive of " + description_.joint + " (bus " + description_.bus + ", node " +
                     std::to_string(description_.node) + "): ";
  if (!heard_) {
    text += "no TPDO yet";
  } else {
    text += std::string(to_string(state_)) + " (statusword " + hex_text(statusword_, 4) + ")";
  }
  if (following_error()) text += ", following error";
  if (internal_limit()) text += ", internal limit active";
  if (fault_ != DriveFault::none) text += std::string("; ") + to_string(fault_);
  if (stuck_ != 0) text += "; " + stuck_text();
  if (emergencies_ > 0) text += "; last " + fieldbus::describe(emergency_);
  return text;
}

}  // namespace proxarm::fieldbus

#include "fieldbus/canopen/bus_leader.hpp"

#include <algorithm>

#include "fieldbus/canopen/canopen_emcy.hpp"
#include "fieldbus/canopen/canopen_heartbeat.hpp"
#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sync.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::uint32_t nmt_id = 0x000, sdo_answer_base = 0x580, sdo_request_base = 0x600;
constexpr std::uint8_t pdos = 4;

const char* name_of(std::uint32_t id) noexcept {
  if (id == nmt_id) return "NMT commands";
  if (id == sync_id) return "SYNC";
  if (id > heartbeat_id(0)) return "a controller's heartbeat";
  return id > sdo_request_base ? "SDO requests" : "setpoints";
}

const char* name_of_nodes(std::uint32_t id) noexcept {
  if (id > heartbeat_id(0)) return "heartbeats";
  if (id < pdo_id(PdoDirection::transmit, 1, 0)) return "EMCYs";
  return id > sdo_answer_base ? "SDO answers" : "PDOs";
}

std::vector<std::uint32_t> ids_of_nodes(const std::vector<std::uint8_t>& nodes) {
  std::vector<std::uint32_t> ids;
  for (const std::uint8_t node : nodes) {
    for (std::uint8_t number = 1; number <= pdos; ++number) {
      ids.push_back(pdo_id(PdoDirection::transmit, number, node));
    }
    ids.insert(ids.end(), {emcy_id(node), sdo_answer_base + node, heartbeat_id(node)});
  }
  return ids;
}

}  // namespace

LeaderWatch::LeaderWatch(BusToLead bus, Listening listening) : bus_(std::move(bus)), listening_(listening) {}

std::vector<std::uint32_t> LeaderWatch::wanted_ids() const {
  if (listening_ == Listening::for_nodes) return ids_of_nodes(bus_.nodes);
  std::vector<std::uint32_t> ids{nmt_id, sync_id};
  if (bus_.master_node != 0) ids.push_back(heartbeat_id(bus_.master_node));
  for (const std::uint8_t node : bus_.nodes) {
    for (std::uint8_t number = 1; number <= pdos; ++number) {
      ids.push_back(pdo_id(PdoDirection::receive, number, node));
    }
    ids.push_back(sdo_request_base + node);
  }
  return ids;
}

void LeaderWatch::on_frame(const CanFrame& frame) {
  if (frame.extended || frame.remote || frame.error) return;
  const std::vector<std::uint32_t> ids = wanted_ids();
  if (std::find(ids.begin(), ids.end(), frame.id) != ids.end()) ++counts_[frame.id];
}

std::string LeaderWatch::signs() const {
  std::string text;
  for (const auto& [id, count] : counts_) {
    const char* name = listening_ == Listening::for_nodes ? name_of_nodes(id) : name_of(id);
    text += (text.empty() ? "" : "; ") + std::string(name) + " (" + hex_text(id, 3) + ")";
    text += ", " + std::to_string(count) + (count == 1 ? " time" : " times");
  }
  return text;
}

namespace {

// Listens on all buses until time_ns has passed. Returns one watch per bus.
std::vector<LeaderWatch> listen(CanNetwork& network, std::span<const BusToLead> buses, Listening listening,
                                std::int64_t time_ns, const FrameHandler& other) {
  std::vector<LeaderWatch> watches;
  for (const BusToLead& bus : buses) watches.emplace_back(bus, listening);
  const FrameHandler on_frame = [&](std::size_t from, const TimedFrame& received) {
    for (std::size_t i = 0; i < buses.size(); ++i) {
      if (buses[i].bus == from) watches[i].on_frame(received.frame);
    }
    if (other) other(from, received);
  };
  const std::int64_t until_ns = network.now_ns() + time_ns;
  pump_frames(network, until_ns, on_frame, [until_ns](std::int64_t) { return until_ns; });
  return watches;
}

// Throws `problem` for the first bus whose watch has seen signs.
void refuse_if_seen(CanNetwork& network, std::span<const BusToLead> buses, const std::vector<LeaderWatch>& watches,
                    description::SetupProblem problem) {
  for (std::size_t i = 0; i < buses.size(); ++i) {
    if (!watches[i].seen()) continue;
    problem.bus = network.bus(buses[i].bus).name();
    problem.found = watches[i].signs();
    throw description::SetupError(std::move(problem));
  }
}

}  // namespace

void require_nobody_leads(CanNetwork& network, std::span<const BusToLead> buses, std::int64_t time_ns,
                          const FrameHandler& other) {
  refuse_if_seen(network, buses, listen(network, buses, Listening::for_leader, time_ns, other),
                 {.message = "somebody leads this bus, and nothing was sent",
                  .expected = "a bus that nobody leads",
                  .advice = "end the other session or master first: two would disturb each other's drives"});
}

void require_nobody_plays(CanNetwork& network, std::span<const BusToLead> buses, std::int64_t time_ns) {
  refuse_if_seen(network, buses, listen(network, buses, Listening::for_nodes, time_ns, {}),
                 {.message = "a drive of this cell is on this bus already, and nothing was sent",
                  .expected = "a bus without the nodes that are to be simulated",
                  .advice = "end the other `proxarm sim`, or take the real drives off: two of one node answer each "
                            "other's requests"});
}

}  // namespace proxarm::fieldbus

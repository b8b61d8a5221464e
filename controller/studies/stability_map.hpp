// The smallest stable mass over timestep, hand, delay and drive: predicted from eigenvalues
// (controller/stability/stability.hpp), and measured by running the controller's own proxy against the same linear
// plant until the motion has grown or shrunk.
//
// Measured: in free motion, the rate at which the oscillation grows or fades once its slowest mode is left; the mass at
// which it does neither is found by halving. A point is ill-conditioned where a per cent of the hand's stiffness moves
// the boundary by more than three (|∂ln M/∂ln K_h| ≥ 3).
//
// At every tenth point the proxy also meets a wall, with the hand pushing on: does it settle, make and break contact
// for good, or diverge? Order 2 steps by (26) at contacts, so the mass that is stable there is the larger of both.
// Eigenvalues know no impacts: the hand's mass m_h answers one with a pulse that comes round after the loop's delay,
// m_h/M as large, and where m_h/M is nearly 1 the next impact adds to what is left of it. So the multiple of the
// smallest mass from which on nothing grows is found by simulation, and a mass is called stable at walls from
// `wall_margin` times the smallest on.
#pragma once

#include "controller/stability/stability.hpp"
#include "controller/studies/common/study.hpp"

namespace proxarm::studies {

class StabilityMap final : public Study {
 public:
  // From that many times the smallest stable mass on a mass is called stable at walls.
  static constexpr double wall_margin = 1.5;

  std::string name() const override { return "stability"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;
  bool failed(const nlohmann::json& headline) const override;
};

// The boundary next to `guess_kg`, measured; not finite where no growth changed sign within a factor of four.
double measured_boundary_kg(const controller::HandModel& hand, const controller::LoopModel& loop, double guess_kg);

}  // namespace proxarm::studies

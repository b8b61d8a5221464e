#include "controller/record/frame_tap.hpp"

namespace proxarm::controller {

class FrameTap::TappedBus final : public fieldbus::CanBus {
 public:
  TappedBus(FrameTap& tap, std::uint32_t index) : tap_(tap), bus_(tap.network_.bus(index)), index_(index) {}

  fieldbus::SendResult send(const fieldbus::CanFrame& frame) noexcept override {
    const fieldbus::SendResult result = bus_.send(frame);
    if (result == fieldbus::SendResult::sent) tap_.frames_.push({frame, tap_.network_.now_ns(), index_});
    return result;
  }
  void send_all(std::span<const fieldbus::CanFrame> frames, std::int64_t now_ns,
                fieldbus::SendResult* results) noexcept override {
    bus_.send_all(frames, now_ns, results);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (results[i] == fieldbus::SendResult::sent) tap_.frames_.push({frames[i], now_ns, index_});
    }
  }
  bool receive(fieldbus::TimedFrame& out) noexcept override {
    if (!bus_.receive(out)) return false;
    tap_.frames_.push({out.frame, out.time_ns, index_});
    return true;
  }
  [[nodiscard]] const fieldbus::BusStatus& status() const noexcept override { return bus_.status(); }
  [[nodiscard]] const std::string& name() const noexcept override { return bus_.name(); }

 private:
  FrameTap& tap_;
  fieldbus::CanBus& bus_;
  std::uint32_t index_;
};

FrameTap::FrameTap(fieldbus::CanNetwork& network, std::size_t capacity) : network_(network), frames_(capacity) {
  for (std::size_t i = 0; i < network.bus_count(); ++i) {
    buses_.push_back(std::make_unique<TappedBus>(*this, static_cast<std::uint32_t>(i)));
  }
}

FrameTap::~FrameTap() = default;

std::size_t FrameTap::bus_count() const noexcept { return buses_.size(); }

fieldbus::CanBus& FrameTap::bus(std::size_t index) noexcept { return *buses_[index]; }

}  // namespace proxarm::controller

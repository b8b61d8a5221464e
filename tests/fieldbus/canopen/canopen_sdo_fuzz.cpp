// libFuzzer: an SDO server that answers with anything. The client must end in time and within its memory.
//
// Input: byte 0 chooses the transfer and the length of what is written; the rest is a stream of records: one byte of
// command (0: let time pass, else: number of data bytes, and whether the object is the right one), then the bytes.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "fieldbus/canopen/canopen_sdo.hpp"

namespace {

using namespace proxarm::fieldbus;

class SinkBus final : public CanBus {
 public:
  SendResult send(const CanFrame& frame) noexcept override {
    if (frame.length != 8 || frame.id != 0x605) std::abort();
    return ++sent_ % 17 == 0 ? SendResult::queue_full : SendResult::sent;
  }
  bool receive(TimedFrame&) noexcept override { return false; }
  [[nodiscard]] const BusStatus& status() const noexcept override { return status_; }
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }

 private:
  BusStatus status_;
  std::string name_ = "fuzz";
  unsigned sent_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  SinkBus bus;
  SdoClientConfig config;
  config.max_upload_bytes = 1024;
  SdoClient client(bus, 5, config);
  const std::uint8_t choice = data[0];
  const auto transfer = (choice & 1) != 0 ? SdoTransfer::block : SdoTransfer::automatic;
  constexpr ObjectAddress object{0x2000, 1};
  std::int64_t now_ns = 0;
  if ((choice & 2) != 0) {
    client.start_upload(object, now_ns, transfer);
  } else {
    client.start_download(object, std::vector<std::uint8_t>(choice >> 2U, 0x5A), now_ns, transfer);
  }
  for (std::size_t at = 1; at < size && !client.finished();) {
    const std::uint8_t command = data[at++];
    now_ns += command == 0 ? config.timeout_ns : 100'000;
    CanFrame frame;
    frame.id = 0x585;
    frame.length = command % 9;
    for (std::size_t i = 0; i < frame.length && at < size; ++i) frame.data[i] = data[at++];
    if ((command & 0x80) != 0) {
      frame.data[1] = 0x00;
      frame.data[2] = 0x20;
      frame.data[3] = 1;
    }
    if (command != 0) client.on_frame(frame, now_ns);
    client.poll(now_ns);
    if (client.data().size() > config.max_upload_bytes) std::abort();
  }
  // Silence ends every transfer: each repeat of a block and the final time-out take one waiting time.
  for (int i = 0; i < 2 * (config.max_block_repeats + 2) && !client.finished(); ++i) {
    now_ns += config.timeout_ns;
    client.poll(now_ns);
  }
  if (!client.finished()) std::abort();
  return 0;
}

// Stores the state of an object that changes from cycle to cycle as bytes. A black box writes these bytes, and a replay
// reads them.
//
// A class lists the members that change once, for writing and reading:
//   void archive(StateArchive& state) noexcept { state(q_k1_, q_k2_, contacts_); }
// Members are plain data, Eigen vectors, or classes with an archive() function. Writing doesn't allocate. The bytes
// that are read may come from untrusted files: this class checks sizes, and the owners of indices must check the
// indices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace proxarm::fieldbus {

class StateArchive {
 public:
  static StateArchive writer(std::span<std::byte> room) noexcept { return {room.data(), nullptr, room.size()}; }
  static StateArchive reader(std::span<const std::byte> bytes) noexcept {
    return {nullptr, bytes.data(), bytes.size()};
  }

  template <typename... Members>
  void operator()(Members&... members) noexcept {
    (pass(members), ...);
  }

  // Writes or reads bytes without a conversion.
  void raw(std::span<std::byte> bytes) noexcept { copy(bytes.data(), bytes.size()); }

  [[nodiscard]] bool reading() const noexcept { return in_ != nullptr; }
  [[nodiscard]] std::size_t bytes() const noexcept { return at_; }
  // False if the room was too small for writing, or if there were too few bytes for reading.
  [[nodiscard]] bool whole() const noexcept { return !short_; }

 private:
  StateArchive(std::byte* out, const std::byte* in, std::size_t size) noexcept : out_(out), in_(in), size_(size) {}

  template <typename Member>
  void pass(Member& member) noexcept {
    if constexpr (requires { member.archive(*this); }) {
      member.archive(*this);
    } else if constexpr (requires {
                           member.allFinite();
                         }) {  // an Eigen vector or matrix; a joint vector keeps its size
      copy(member.data(), sizeof(double) * static_cast<std::size_t>(member.size()));
    } else if constexpr (requires { member.coeffs().data(); }) {  // a quaternion
      copy(member.coeffs().data(), sizeof(double) * 4);
    } else if constexpr (std::is_same_v<Member, bool>) {
      std::uint8_t byte = member ? 1 : 0;
      copy(&byte, 1);
      member = byte != 0;
    } else {
      static_assert(std::is_trivially_copyable_v<Member> && !std::is_pointer_v<Member>);
      copy(&member, sizeof member);
    }
  }

  void copy(void* member, std::size_t bytes) noexcept {
    if (short_ || bytes > size_ - at_) {
      short_ = true;
      return;
    }
    if (in_ != nullptr) {
      std::memcpy(member, in_ + at_, bytes);
    } else {
      std::memcpy(out_ + at_, member, bytes);
    }
    at_ += bytes;
  }

  std::byte* out_;
  const std::byte* in_;
  std::size_t size_;
  std::size_t at_ = 0;
  bool short_ = false;
};

}  // namespace proxarm::fieldbus

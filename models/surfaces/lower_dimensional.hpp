// Renders a world of one or two dimensions with a 𝒢 of three dimensions; the added coordinates stay zero.
//
// Precondition: all surface normals of the 𝒢 of three dimensions lie in the first N dimensions. Then all its forces lie
// in these dimensions, too.
#pragma once

#include <array>
#include <memory>

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::models {

template <int N>
class LowerDimensional final : public GeometricAlgorithm<N> {
 public:
  explicit LowerDimensional(std::unique_ptr<GeometricAlgorithm<3>> space) : space_(std::move(space)) {}

  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const Vec<N> r = (*space_)(K, lift<N>(p), lift<N>(q)).template head<N>();
    count_ = 0;
    for (const Contact<3>& contact : space_->contacts()) {
      if (count_ == contacts_.size()) break;
      contacts_[count_++] = {contact.object, contact.feature, contact.slips, contact.normal.template head<N>()};
    }
    return r;
  }

  void set_time(const StepTime& time) noexcept override { space_->set_time(time); }
  [[nodiscard]] bool wants_time() const noexcept override { return space_->wants_time(); }
  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return space_->unresolved_steps(); }
  [[nodiscard]] bool squeezed() const noexcept override { return space_->squeezed(); }

 private:
  std::unique_ptr<GeometricAlgorithm<3>> space_;
  std::array<Contact<N>, 4> contacts_{};
  std::size_t count_ = 0;
};

}  // namespace proxarm::models

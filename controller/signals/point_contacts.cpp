#include "controller/signals/point_contacts.hpp"

#include <span>

namespace proxarm::controller {
namespace {

using models::Vec3;
using Sizes = std::array<double, most_contacts>;

// Returns the sizes a ≥ 0 that minimise ‖f − Σ aᵢ nᵢ‖, by projected Gauss-Seidel. Each sweep divides the error by 4 in
// a corner of 60°, and by 1.03 in a corner of 10°. The error that is left then counts as friction.
Sizes pressing(std::span<const RecordedContact> contacts, const Vec3& f) noexcept {
  constexpr int sweeps = 200;
  Sizes sizes{};
  Vec3 rest = f;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Vec3 n = vec3(contacts[i].normal_W);
      const double before = sizes[i];
      sizes[i] = std::max(0.0, before + n.dot(rest));
      rest -= (sizes[i] - before) * n;
    }
  }
  return sizes;
}

// Returns each contact's share of the friction. The shares add up to 1.
Sizes rubbing(std::span<const RecordedContact> contacts, const Sizes& pressing) noexcept {
  Sizes shares{};
  double sum = 0.0;
  const auto share_by = [&](const auto& weight) {
    for (std::size_t i = 0; i < contacts.size(); ++i) sum += shares[i] = weight(i);
  };
  share_by([&](std::size_t i) { return contacts[i].friction * pressing[i]; });
  if (!(sum > 0.0)) share_by([&](std::size_t i) { return pressing[i]; });
  if (!(sum > 0.0)) share_by([](std::size_t) { return 1.0; });
  for (double& share : shares) share /= sum;
  return shares;
}

}  // namespace

void place_contacts(CycleRecord& record) noexcept {
  const std::span<RecordedContact> contacts(record.contacts.data(), record.recorded_contacts());
  for (RecordedContact& contact : contacts) {
    contact.point_W_m = record.proxy_W_m;
    contact.force_W_N = record.contact_force_W_N;
  }
  if (contacts.size() < 2) return;
  const Vec3 f = vec3(record.contact_force_W_N);
  const Sizes sizes = pressing(contacts, f), shares = rubbing(contacts, sizes);
  Vec3 friction = f;
  for (std::size_t i = 0; i < contacts.size(); ++i) friction -= sizes[i] * vec3(contacts[i].normal_W);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    contacts[i].force_W_N = triple(sizes[i] * vec3(contacts[i].normal_W) + shares[i] * friction);
  }
}

}  // namespace proxarm::controller

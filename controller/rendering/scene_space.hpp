// Converts places between W and the N coordinates of a scene (scenes/compiler/compile.hpp): x = Uᵀ(q_W − o). In W, the
// component of the start position outside the scene's space is kept.
#pragma once

#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

template <int N>
class SceneSpace {
 public:
  using V = models::Vec<N>;

  explicit SceneSpace(const scenes::CompiledScene& scene) : scene_(&scene), basis_(scene.space.axes.leftCols<N>()) {}

  void start(const models::Vec3& q_W) noexcept {
    start_W_ = q_W;
    start_ = scene_->from_W<N>(q_W);
  }

  // If a three-dimensional scene has W's axes, its coordinates are W's coordinates, so the conversion is exact.
  [[nodiscard]] models::Vec3 to_W(const V& x) const noexcept {
    if constexpr (N == 3) {
      return scene_->to_W<N>(x);
    } else {
      return start_W_ + basis_ * (x - start_);
    }
  }
  [[nodiscard]] V from_W(const models::Vec3& q_W) const noexcept {
    if constexpr (N == 3) {
      return scene_->from_W<N>(q_W);
    } else {
      return start_ + basis_.transpose() * (q_W - start_W_);
    }
  }
  [[nodiscard]] const Eigen::Matrix<double, 3, N>& basis() const noexcept { return basis_; }  // U
  [[nodiscard]] const V& start() const noexcept { return start_; }
  [[nodiscard]] const models::Vec3& start_W() const noexcept { return start_W_; }

  void archive(fieldbus::StateArchive& state) noexcept { state(start_W_, start_); }

 private:
  const scenes::CompiledScene* scene_;
  Eigen::Matrix<double, 3, N> basis_;
  models::Vec3 start_W_ = models::Vec3::Zero();
  V start_ = V::Zero();
};

}  // namespace proxarm::controller

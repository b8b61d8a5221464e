// Finds the pairs of features that may meet: of a cylinder and another body, or of two cylinders.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "models/rigid_bodies/pair.hpp"
#include "models/rigid_cylinder/beside_cylinder.hpp"
#include "models/rigid_features/near.hpp"

namespace proxarm::models {

// Finds the pairs of a cylinder and another body, in the body's frame. It calls add(kind, cylinder's feature, body's
// feature) for all features within `reach` of each other (m), and for some others.
template <typename Add>
class CylinderPairs {
 public:
  CylinderPairs(const Cylinder& cylinder, const BesideCylinder& body, double reach, Add add) noexcept
      : cylinder_(&cylinder), body_(&body), near_(reach + body.radius()), add_(add) {}

  void point(std::uint32_t i) const noexcept {
    const Vec3 p = body_->point(i), way = p - cylinder_->from;
    const double along = cylinder_->axis.dot(way);
    const double beside = (way - along * cylinder_->axis).norm() - cylinder_->radius;
    if (std::max({beside, -along, along - cylinder_->length}) > near_) return;
    if (beside >= -near_) add_(PairKind::side_point, 0U, i);
    for (const std::uint32_t end : {0U, 1U}) {
      if (cylinder_->before_end(end, p) < -near_) continue;
      add_(PairKind::end_point, end, i);
      if (body_->radius() > 0.0) add_(PairKind::rim_point, end, i);
    }
  }
  void edge(std::uint32_t i) const noexcept {
    const EdgeLine edge = body_->edge(i);
    const double most = near_ + cylinder_->radius;
    if (distance2_of_segments(edge, axis_of(*cylinder_)) > most * most) return;
    add_(PairKind::side_edge, 0U, i);
    const Vec3 middle = 0.5 * (edge.from + edge.to);
    const double half = 0.5 * (edge.to - edge.from).norm();
    for (const std::uint32_t end : {0U, 1U}) {
      if (ball_comes_near_rim(end, middle, half)) add_(PairKind::rim_edge, end, i);
    }
  }
  void face(std::uint32_t i) const noexcept {
    const BesideCylinder::Face face = body_->face(i);
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t corner : face.ring) middle += face.points[corner] / static_cast<double>(face.ring.size());
    double half2 = 0.0;
    for (const std::uint32_t corner : face.ring) half2 = std::max(half2, (face.points[corner] - middle).squaredNorm());
    for (const std::uint32_t end : {0U, 1U}) {
      const Solid::Rim& rim = cylinder_->rims[end];
      if (std::abs(BesideCylinder::height_of_lowest(rim, face.normal, face.offset)) > near_) continue;
      if (ball_comes_near_rim(end, middle, std::sqrt(half2))) add_(PairKind::rim_face, end, i);
    }
  }

 private:
  [[nodiscard]] bool ball_comes_near_rim(std::uint32_t end, const Vec3& middle, double radius) const noexcept {
    const double height = cylinder_->before_end(end, middle), most = near_ + radius;
    const Vec3 across = middle - cylinder_->rims[end].centre - height * cylinder_->out_of_end(end);
    const double beside = across.norm() - cylinder_->radius;
    return height * height + beside * beside <= most * most;
  }

  const Cylinder* cylinder_;
  const BesideCylinder* body_;
  double near_;
  Add add_;
};

// Whether a rim may come within `near` of an end of another cylinder: tests the heights of the rim's points over the
// plane of the end, and the distance of the two centres across the other cylinder's axis.
inline bool comes_near_end(const Solid::Rim& rim, const Cylinder& other, std::uint32_t end, double near) noexcept {
  const double height = other.before_end(end, rim.centre);
  const double down = rim.radius * std::hypot(other.axis.dot(rim.u), other.axis.dot(rim.v));
  const Vec3 across = rim.centre - other.rims[end].centre - height * other.out_of_end(end);
  return std::abs(height) <= near + down && across.norm() <= rim.radius + other.radius + near;
}

// Calls add(kind, own feature, other feature) for the features of two cylinders that may be within `reach` of each
// other. Both cylinders are in one frame.
template <typename Add>
void each_pair_of_cylinders(const Cylinder& own, const Cylinder& other, double reach, Add add) noexcept {
  const EdgeLine own_axis = axis_of(own), other_axis = axis_of(other);
  const double most = reach + own.radius + other.radius;
  if (distance2_of_segments(own_axis, other_axis) > most * most) return;
  add(PairKind::sides, 0U, 0U);
  for (const std::uint32_t i : {0U, 1U}) {
    if (distance2_to_segment(own.rims[i].centre, other_axis) <= most * most) add(PairKind::rim_side, i, 0U);
    if (distance2_to_segment(other.rims[i].centre, own_axis) <= most * most) add(PairKind::side_rim, 0U, i);
    for (const std::uint32_t j : {0U, 1U}) {
      const bool own_near = comes_near_end(own.rims[i], other, j, reach);
      const bool other_near = comes_near_end(other.rims[j], own, i, reach);
      if (own_near) add(PairKind::rim_end, i, j);
      if (other_near) add(PairKind::end_rim, i, j);
      if (own_near && other_near) add(PairKind::rims, i, j);
    }
  }
}

}  // namespace proxarm::models

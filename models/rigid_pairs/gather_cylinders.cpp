// Gathers the pairs with a feature of a cylinder.
#include "models/rigid_cylinder/cylinder_pairs.hpp"
#include "models/rigid_features/part_box.hpp"
#include "models/rigid_pairs/gathering.hpp"

namespace proxarm::models {

void Gathering::gather_cylinder(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const RigidPart& own = bodies_->setup().parts[part];
  const RigidEntry& other = bodies_->setup().entries[entry];
  if (own.cylinder && other.cylinder) return gather_cylinders(part, entry, at, reach);
  const bool ours = own.cylinder.has_value();
  const View to = ours ? at : inverse(at);
  const BesideCylinder body = beside_cylinder(own, other);
  const Cylinder cylinder = moved(ours ? *own.cylinder : *other.cylinder, to.R, to.x);
  const CylinderPairs pairs(cylinder, body, reach, [&](PairKind kind, std::uint32_t round, std::uint32_t feature) {
    add(kind, part, entry, ours ? round : feature, ours ? feature : round, 0.0);
  });
  if (const TriangleFeatures* mesh = body.mesh()) {
    std::size_t looked_at = 0;
    const PartBox around(ours ? own.solid : *other.solid(), ours ? own.box : other.box, to, reach);
    around.each_face(mesh->mesh(), [&](std::uint32_t face, const Bounds& /*box*/) {
      if (!take_face(looked_at)) return false;
      pairs.face(face);
      for (const std::uint32_t v : mesh->vertices_of(face)) pairs.point(v);
      for (const std::uint32_t e : mesh->edges_of(face)) {
        if (body.sticks_out(e)) pairs.edge(e);
      }
      return true;
    });
    out_->triangles_near += looked_at;
    return;
  }
  const Solid& solid = *body.solid();
  for (std::uint32_t i = 0; i < solid.points.size(); ++i) pairs.point(i);
  for (std::uint32_t i = 0; i < solid.edges.size(); ++i) pairs.edge(i);
  for (std::uint32_t i = 0; i < solid.faces.size(); ++i) pairs.face(i);
}

void Gathering::gather_cylinders(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept {
  const Cylinder own = moved(*bodies_->setup().parts[part].cylinder, at.R, at.x);
  each_pair_of_cylinders(own, *bodies_->setup().entries[entry].cylinder, reach,
                         [&](PairKind kind, std::uint32_t i, std::uint32_t j) { add(kind, part, entry, i, j, 0.0); });
}

}  // namespace proxarm::models

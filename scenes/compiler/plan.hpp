// The choices that compile() makes for a scene, and their reasons, as plain data. compile() builds from a plan, and
// explain() describes the same plan, so they can't contradict each other.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

struct Plan {
  // The smallest 𝒢 that renders the objects and the guide.
  enum class Contacts : std::uint8_t {
    none,                 // nothing to touch: FreeSpace, unless a Coulomb field is the whole scene
    plane,                // one flat rigid surface at rest, without friction: (2)
    friction_plane,       // one flat rigid surface at rest, with friction: (4)
    planes,               // up to 64 flat rigid surfaces at rest: PlaneComposition
    mesh,                 // one mesh at rest, without a layer: MeshSurface
    guide,                // a guide without objects: PlaneGuide or PolylineGuide
    guide_among_objects,  // a line or polyline on which objects stop and push the proxy: PolylineGuide with a World
    world,                // anything else, including a guide on a plane among objects: World
  };
  enum class Friction : std::uint8_t {
    none,        // μ = 0
    no_tangent,  // μ > 0, but a line has no tangent to slip along
    // μ > 0, and the proxy can slip along a tangent.
    acts,
  };
  enum class Coulomb : std::uint8_t {
    none,
    field,   // (3), instead of free space
    medium,  // one of several media, or a medium with contacts
  };

  Contacts contacts = Contacts::none;
  Friction friction = Friction::none;  // friction of the contacts
  Coulomb coulomb = Coulomb::none;

  std::optional<std::int32_t> only_object;  // the object to which all contacts belong, if there is only one
  std::vector<std::int32_t> missed;         // objects that the proxy's space doesn't meet
  // Pairs of flush objects that act as one.
  std::vector<std::pair<std::int32_t, std::int32_t>> joined;
  std::size_t surfaces = 0;  // number of surfaces of a World or a PlaneComposition
  std::size_t layers = 0;
  std::size_t moving = 0;
  std::optional<GuideDescription> guide;  // the guide in coordinates of the proxy's space
};

// A part of the compiled scene, or a part that was left out, with the reason.
struct Stage {
  std::string what;
  std::string why;
};

// A plan as text.
struct Narration {
  std::vector<Stage> stages;   // parts in the order in which a step uses them
  std::vector<Stage> skipped;  // parts that this scene doesn't need
};

// Precondition: the plan was made for this scene.
Narration narrate(const Scene& scene, const Plan& plan);

// Returns the first pairs of flush objects as text, such as "box 1 and box 2, …".
std::string joined_text(const Scene& scene, const Plan& plan);

}  // namespace proxarm::scenes

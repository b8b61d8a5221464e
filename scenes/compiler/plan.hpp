// What compile() has chosen to render a scene with, and what about the scene made it choose: plain data. compile()
// builds from a plan, and explain() narrates the same one, so that the two can't disagree.
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
    none,                 // there is nothing to touch: FreeSpace, unless a Coulomb field is all there is
    plane,                // one flat surface, rigid and still, without friction: (2)
    friction_plane,       // one with friction: (4)
    planes,               // up to 64 of them: PlaneComposition
    mesh,                 // one mesh, still and without a layer: MeshSurface
    guide,                // a guide without objects: PlaneGuide or PolylineGuide
    guide_among_objects,  // a line or a polyline, on which objects stop and push the proxy: PolylineGuide with a World
    world,                // anything else, among objects a guide on a plane, too: World
  };
  enum class Friction : std::uint8_t {
    none,        // μ = 0
    no_tangent,  // μ > 0, but a line has no tangent to slip along
    acts,
  };
  enum class Coulomb : std::uint8_t {
    none,
    field,   // (3), in the place of free space
    medium,  // over other media or contacts: one more of the media
  };

  Contacts contacts = Contacts::none;
  Friction friction = Friction::none;  // of the contacts
  Coulomb coulomb = Coulomb::none;

  std::optional<std::int32_t> only_object;  // the scene's object that is all of the contacts
  std::vector<std::int32_t> missed;         // objects that the proxy's space doesn't meet
  // Pairs of objects that stand flush and hold as one.
  std::vector<std::pair<std::int32_t, std::int32_t>> joined;
  std::size_t surfaces = 0;               // which a World or a PlaneComposition is made of
  std::size_t layers = 0;                 // elastic objects
  std::size_t moving = 0;                 // objects that move
  std::optional<GuideDescription> guide;  // in coordinates of the proxy's space
};

// One line of what was compiled in or left out.
struct Stage {
  std::string what;
  std::string why;
};

// A plan in words.
struct Narration {
  std::vector<Stage> stages;   // in the order in which a step goes through them
  std::vector<Stage> skipped;  // what this scene doesn't need
};

// Precondition: the plan is that of the scene.
Narration narrate(const Scene& scene, const Plan& plan);

// "box 1 and box 2, …", the first few of them.
std::string joined_text(const Scene& scene, const Plan& plan);

}  // namespace proxarm::scenes

// 𝒢 of a rigid tool among rigid objects (models/geometry/pose_algorithm.hpp states the law).
//
// 1. Candidates (rigid_candidates.cpp): pairs of features, one of the tool and one of an object, that come within a
//    distance of each other that the steps to come won't exceed. They are gathered anew only when the tool has moved so
//    far.
// 2. At a pose q_i each pair has a gap, a normal and a material point (rigid_gaps.cpp, rigid_deeper.cpp,
//    rigid_shapes/touch.hpp). Linearised there, those that press or would be passed make a local problem
//    (rigid_linear.cpp, contact_problem.hpp); its solution is the next pose. Gaps and normals are taken again until
//    nothing moves: a fixed point is exact, since at δ = 0 nothing is linearised. It converges by the ratio of the
//    step's penetration to the radius of curvature, a thousandth or less. Where surfaces conform (a peg in its hole)
//    that radius is their clearance, and the ratio far above one: there the gaps' curvature goes into the problem as
//    well (rigid_bends.cpp), which makes this Newton's method.
// 3. On which side of a face or an edge the tool is, is what it was at q(k−1) (rigid_sides.cpp). A long step is taken
//    in parts (rigid_steps.cpp), on the way from q(k−1) to p̂, each so short that no feature gets past the sides' reach;
//    each part is a step of 𝒢 from q(k−1). A solution in which the contacts did work on the tool is on a side to which
//    it didn't come: then the parts are made smaller, and where they lead nowhere the step is unresolved.
//
// 4. An object that moves is touched in its own frame (rigid_motion.cpp): there the tool comes from where it was
//    relative to where the object was. What was at rest on it moves with it, and slip is what a material point of the
//    tool has moved beyond that. Parts of a step divide both motions. What can't reach the tool within a step isn't
//    looked at. Where the tool has no room left, it is squeezed.
//
// Friction between a part with a friction of its own and an object: √(μ_tool μ_object); otherwise the object's.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "models/geometry/pose_algorithm.hpp"
#include "models/local_problem/contact_problem.hpp"
#include "models/rigid/beside_cylinder.hpp"
#include "models/rigid_features/mesh_overlap.hpp"
#include "models/rigid_features/near_faces.hpp"
#include "models/rigid_features/near_lists.hpp"
#include "models/rigid_features/node_discs.hpp"
#include "models/rigid_features/rigid_features.hpp"
#include "models/rigid_features/rigid_mover.hpp"
#include "models/rigid_shapes/cylinder.hpp"

namespace proxarm::models {

class RigidWorld final : public PoseAlgorithm {
 public:
  // Throws std::invalid_argument for a tool without parts (a point is rendered by a World), a tool's shape without a
  // size, points that span no solid, a mesh that is open, a friction below 0, a cylinder as an object, and one as a
  // tool beside solids, meshes or a tube with round ends. An open mesh as an object, which compile_rigid() refuses, is
  // held from both sides, but what is sharp may pass its border by micrometres.
  RigidWorld(const Tool& tool, std::vector<RigidObject> objects);

  const ToolPose& step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept override;
  void set_time(const StepTime& time) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return !moving_.empty(); }
  void set_friction(std::int32_t object, double friction) noexcept override;
  void drive(std::int32_t object, const Pose& X) noexcept override;

  [[nodiscard]] std::span<const PoseContact> contacts() const noexcept override { return {contacts_.data(), count_}; }
  [[nodiscard]] bool unresolved() const noexcept override { return unresolved_; }
  [[nodiscard]] bool squeezed() const noexcept override { return squeezed_; }
  // Where more is near than a step has room for, a lower bound. Between corners that face each other, where no feature
  // holds another one, more than their distance.
  [[nodiscard]] double clearance_m(const ToolPose& pose) const noexcept override;
  [[nodiscard]] double clearance_at_m(const ToolPose& pose, double time_s) const noexcept override;
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override;
  void copy_state(const PoseAlgorithm& other) noexcept override;

  RigidWorld(const RigidWorld&);
  RigidWorld& operator=(const RigidWorld&) noexcept;
  ~RigidWorld() override;

 private:
  enum class Kind : std::uint8_t {
    point_field,
    rim_field,
    point_face,
    face_point,
    edges,        // both sharp
    round_edges,  // one of them has a radius
    point_point,
    point_edge,
    edge_point,
    // Of a cylinder's features and those of the other one, whichever is the tool.
    side_point,
    end_point,
    rim_point,
    side_edge,
    rim_edge,
    rim_face,
    // Of two cylinders, the tool's first.
    sides,
    rim_side,
    side_rim,
    rim_end,
    end_rim,
    rims
  };
  struct Pair {
    Kind kind = Kind::point_field;
    std::uint16_t part = 0, entry = 0;
    std::uint32_t own = 0, other = 0;
    float side = 0.0F;  // of a two-sided surface: 1 or −1, or 0 where the pair is not to be judged in this step
    bool pressed = false;
    bool barred = false;   // its normal is none that the two have there: not to be judged in this part of the step
    float apart_m = 0.0F;  // at least, when it was gathered; of a cylinder's 0
    Vec3 force_W = Vec3::Zero();            // of the last solution
    std::array<double, 2> level{1.0, 0.0};  // where a rim that lies flat was lowest, in its u and v
  };
  struct KeptPairs {
    std::array<Pair, ContactProblem::most> pairs;
    std::size_t count = 0;
  };
  // A pair at a pose.
  struct Found {
    Touch touch;  // in W
    std::uint16_t pair = 0;
    std::uint8_t which = 0;  // of a rim
    bool working = false;
    bool over = false;  // its foot is beyond a valley or an edge's end
  };
  struct Part {
    Solid solid;
    Bounds box;  // of its points, in T
    std::optional<double> friction;
    std::shared_ptr<const TriangleFeatures> mesh{};  // of a mesh, whose features are the solid's as well
    std::optional<Cylinder> cylinder{};
    NodeDiscs discs{};  // of a mesh, where it may meet one
  };
  struct Entry {
    RigidObject object;
    Bounds bounds;
    Bounds box{};       // of a solid's points
    double held = 0.0;  // of a closed mesh: 1 or −1, the side of its faces on which the tool is
    std::optional<Cylinder> cylinder{};
    NodeDiscs discs{};  // of a mesh, where a part that is one may meet it
  };
  // Of parts and entries that may meet as meshes.
  [[nodiscard]] static FlatMesh flat_mesh(const Part& part) noexcept { return {part.mesh->mesh(), part.discs}; }
  [[nodiscard]] static FlatMesh flat_mesh(const Entry& entry) noexcept {
    return {(*std::get_if<std::shared_ptr<const TriangleFeatures>>(&entry.object.shape))->mesh(), entry.discs};
  }
  struct AtPose {  // the cylinder of such a part and entry, seen from the other one, at the pose of find()
    bool known = false;
    std::uint16_t part = 0, entry = 0;
    Cylinder cylinder;
  };
  struct Pressed {  // a place of a pair that pressed in the last solution, and how hard
    std::uint16_t pair = 0;
    std::uint8_t which = 0;
    Vec3 force_W = Vec3::Zero();
    Vec3 place_W = Vec3::Zero();  // of the material point, where it goes with that solution
  };
  struct Shared {  // constant
    std::vector<Part> parts;
    std::vector<Entry> entries;    // first those that stand still
    std::size_t first_moving = 0;  // of the entries
    double reach = 0.0;            // of the tool's points from the reference point
    double thinness = 0.0;         // the least thickness of the tool's parts
    bool hollow = false;           // a sphere or a tube
    bool bends = false;            // something is hollow, or the tool has rims: gaps' curvature counts
    bool edges_bend = false;  // edges may meet of which one is round: it counts where they nearly lie along each other
    bool dense = false;       // there is a mesh, or there are many solids
  };
  static constexpr double kEverywhere_m = std::numeric_limits<double>::infinity();
  // So many contacts may be looked at in a step's local problems, some 0.2 µs each. Without it local problems that have
  // no solution took up to 13 ms of a cycle.
  static constexpr int kWork = 1200;
  // Where gaps bend the last step of the iteration turns normals by no more than 1e-10 of a clearance of ten
  // micrometres.
  static constexpr double kStill_m = 1e-15;
  static constexpr int kMostParts = 512;  // of a step. A longer one, 10 cm for a tool of a millimetre, ends before p̂
  static constexpr int kMostStrides = 1 << 16;  // the same, among objects that move
  static constexpr std::size_t most_pairs = 768;
  static constexpr std::size_t most_found = 512;
  static constexpr std::size_t most_faces = NearFaces::most_faces, most_edges = NearFaces::most_edges;
  static constexpr std::size_t most_leaves = 4096;  // of two meshes, near each other

  // Of an entry that moves.
  struct Moving {
    RigidMover mover;
    bool close = true;                                // may meet the tool in this step
    ToolPose gathered{};                              // the tool, seen from the object, when the pairs were gathered
    View tool{}, from{};                              // seen from the object: now, and where the sides were taken
    Vec3 slid = Vec3::Zero(), turned = Vec3::Zero();  // of the tool since q(k−1), seen from the object; m, rad
  };
  [[nodiscard]] double motion(const ToolPose& a, const ToolPose& b) const noexcept;
  [[nodiscard]] double size_m(const Twist& xi) const noexcept;  // of a motion

  [[nodiscard]] bool moves(std::uint16_t entry) const noexcept { return entry >= shared_->first_moving; }
  [[nodiscard]] bool goes(std::uint16_t entry) const noexcept { return moves(entry) && !moving(entry).mover.rests(); }
  [[nodiscard]] Moving& moving(std::uint16_t entry) noexcept { return moving_[entry - shared_->first_moving]; }
  [[nodiscard]] const Moving& moving(std::uint16_t entry) const noexcept {
    return moving_[entry - shared_->first_moving];
  }
  [[nodiscard]] View seen_from(std::uint16_t entry, const View& tool) const noexcept;
  [[nodiscard]] double room_m(std::uint16_t entry, const ToolPose& pose) const noexcept;
  [[nodiscard]] double let_come(const ToolPose& p_hat, const ToolPose& q) noexcept;
  [[nodiscard]] std::size_t alone_with(const ToolPose& q, double near) const noexcept;
  [[nodiscard]] ToolPose on_the_way(const ToolPose& p_hat, const ToolPose& q_old, double share) const noexcept;
  [[nodiscard]] std::size_t first_pair() const noexcept { return riding_ == nobody ? 0 : still_count_; }
  [[nodiscard]] double came_m(const ToolPose& q) const noexcept;
  void let_go(double share) noexcept;
  ToolPose let_go_with(const ToolPose& q, double share) noexcept;
  [[nodiscard]] ToolPose along_with_holder(const ToolPose& q) const noexcept;
  [[nodiscard]] bool something_comes() const noexcept;
  [[nodiscard]] bool has_room(const ToolPose& pose) noexcept;
  bool give_way(ToolPose& q) noexcept;
  [[nodiscard]] double least_gap_m(const ToolPose& pose) noexcept;
  void see_slip(const ToolPose& pose, const ToolPose& q_old) noexcept;
  [[nodiscard]] Vec3 slip_on(std::uint16_t entry, const Vec3& lever) const noexcept;
  [[nodiscard]] Vec3 slip_since(const ToolPose& q_old, std::uint16_t entry, const Vec3& point,
                                const ToolPose& pose) const noexcept;

  void advance(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept;
  void forget() noexcept;
  void gather_for(const ToolPose& q, double far) noexcept;
  void gather(const ToolPose& pose, double reach) noexcept;
  bool look_around(const ToolPose& pose, double reach, std::size_t pairs = most_pairs,
                   std::size_t faces = most_faces) noexcept;
  [[nodiscard]] KeptPairs pressed_pairs() const noexcept;
  void restore(const KeptPairs& kept) noexcept;
  void list_leaves(const ToolPose& pose, double reach) noexcept;
  void list_leaves_within(const ToolPose& pose, double reach) noexcept;
  [[nodiscard]] bool may_reach(const Part& part, const Entry& entry, const View& at, double reach) const noexcept;
  void gather_entry(std::uint16_t entry, const ToolPose& pose, double reach) noexcept;
  void gather_part(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void gather_cylinder(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void gather_meshes(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void add_pair(Kind kind, std::uint16_t part, std::uint16_t entry, std::uint32_t own, std::uint32_t other,
                double apart_m) noexcept;
  [[nodiscard]] static bool is_flat_rim(Kind kind) noexcept {  // a rim over something flat
    return kind == Kind::rim_field || kind == Kind::rim_face || kind == Kind::rim_end || kind == Kind::end_rim;
  }
  [[nodiscard]] static Kind other_way_round(Kind kind) noexcept;
  template <typename Add>
  void pairs_with(const Solid& own, const Bounds& own_box, const Solid& other, const Bounds& other_box, const View& at,
                  double reach, Add add) const noexcept;
  template <typename Add>
  void points_with(const Solid& own, const TriangleFeatures& other, double side, const NearFaces& close, const View& at,
                   Add add) const noexcept;
  template <typename Add>
  void vertex_with(const Solid& own, const TriangleFeatures& other, std::uint32_t v, const Mat3& to_T, const Vec3& y,
                   NearFaces& close, Add add) const noexcept;
  template <typename Add>
  void edge_with(const Solid& own, const TriangleFeatures& other, std::uint32_t e, const View& at, NearFaces& close,
                 Add add) const noexcept;
  // Of a solid and a mesh.
  template <typename Add>
  void pairs_with(const Solid& own, const TriangleFeatures& other, double side, const View& at, NearFaces& close,
                  Add add) noexcept;
  bool list_triangles(std::uint16_t part, std::uint16_t entry, const NearFaces& close) noexcept;
  void set_sides(const ToolPose& from, double far) noexcept;
  [[nodiscard]] double side_of_tools_face(const Pair& pair, const View& at, double height, double far) const noexcept;
  [[nodiscard]] double side_of_solids_face(const Pair& pair, const View& at, double height, double far) const noexcept;
  [[nodiscard]] double side_of_mesh(const Pair& pair, const View& at, double height, double far) const noexcept;
  [[nodiscard]] bool crossed(const Pair& pair, const Vec3& p) const noexcept;
  [[nodiscard]] EdgeLine own_edge(const Pair& pair) const noexcept;    // of the tool, in T
  [[nodiscard]] EdgeLine other_edge(const Pair& pair) const noexcept;  // of the object, in its frame
  [[nodiscard]] double signed_start(const Pair& pair, const View& at) const noexcept;
  template <typename Each>
  void evaluate(const Pair& pair, const View& at, Each each) noexcept;
  [[nodiscard]] std::optional<Touch> over_valley(const Pair& pair, const View& at) const noexcept;
  template <typename Each>
  void evaluate_over(const Pair& pair, const View& at, Each each) noexcept;
  [[nodiscard]] bool is_beyond_edge(const Pair& pair, double gap, const View& at) const noexcept;
  struct AtCylinder;
  [[nodiscard]] BesideCylinder beside_cylinder(std::uint16_t part, std::uint16_t entry) const noexcept;
  [[nodiscard]] int meet(const Pair& pair, const AtCylinder& here, std::array<Meeting, 4>& out) const noexcept;
  [[nodiscard]] int meet_face(const Pair& pair, const AtCylinder& here, std::array<Meeting, 4>& out) const noexcept;
  [[nodiscard]] bool counts(const Pair& pair, const AtCylinder& here, const Meeting& meeting) const noexcept;
  [[nodiscard]] bool was_behind(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept;
  [[nodiscard]] bool came_around(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept;
  [[nodiscard]] bool was_behind_edge(const Pair& pair, const AtCylinder& here, const Vec3& place) const noexcept;
  [[nodiscard]] View from_of(const Pair& pair) const noexcept;
  // The places where the two may touch; infinitely far where one doesn't count. Returns their number.
  [[nodiscard]] int touch_cylinder(const Pair& pair, const View& at, std::array<Touch, 4>& out) noexcept;
  [[nodiscard]] Cylinder seen_from_other(const Pair& pair, const View& at) const noexcept;
  [[nodiscard]] const Cylinder& cylinder_found(const Pair& pair, const View& at) noexcept;
  // The rim of a pair, and the side that it lies on.
  [[nodiscard]] FlatSide side_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept;
  [[nodiscard]] FlatSide end_under_rim(const Pair& pair, const View& at, Solid::Rim& rim) const noexcept;
  void gather_cylinders(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  struct TwoCylinders;
  [[nodiscard]] int meet(const Pair& pair, const TwoCylinders& here, std::array<Meeting, 4>& out) const noexcept;
  [[nodiscard]] bool counts(const Pair& pair, const TwoCylinders& here, const Meeting& meeting) const noexcept;
  [[nodiscard]] int touch_cylinders(const Pair& pair, const View& at, std::array<Touch, 4>& out) const noexcept;
  [[nodiscard]] static Solid::Rim rim_at(const Solid::Rim& rim, const View& at) noexcept;
  void remember_lowest(Pair& pair, const View& at) const noexcept;
  // Of what may be touched where the tool moves on by no more than `within_m`.
  void find(const ToolPose& pose, double within_m = kEverywhere_m) noexcept;
  void look_at_pairs(const ToolPose& pose, double within_m) noexcept;
  [[nodiscard]] bool needs_others(const Found& found) const noexcept;
  void drop_deeper(const View& at) noexcept;
  [[nodiscard]] bool beside(const Found& deep, const View& at) const noexcept;
  [[nodiscard]] bool passes_by(const Found& deep, const View& at) const noexcept;
  [[nodiscard]] bool rises_from(const Pair& one, const Pair& other) const noexcept;
  [[nodiscard]] bool leans_into(const Found& corner, const View& at) const noexcept;
  [[nodiscard]] bool reaches_beyond(const Found& found, const View& at) const noexcept;
  bool bar_what_reaches_beyond(const ToolPose& pose) noexcept;
  [[nodiscard]] double friction(const Pair& pair) const noexcept;
  void linearise(const Found& found, const ToolPose& pose, const ToolPose& q_old, LinearContact& out,
                 Mat3& frame) const noexcept;
  [[nodiscard]] const Pressed* last_pressed(std::uint16_t pair, std::uint8_t which) const noexcept;
  // Round, and straight for a way: the place of contact goes far along it with next to no turn.
  [[nodiscard]] static bool is_along_side(Kind kind) noexcept {
    return kind == Kind::sides || kind == Kind::side_edge || kind == Kind::round_edges;
  }
  bool add_bend(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept;
  bool add_bend_of_rim(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept;
  bool add_bend_of_sides(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept;
  struct NearSides;
  [[nodiscard]] std::optional<NearSides> near_sides(const Found& found, const ToolPose& pose) const noexcept;
  [[nodiscard]] Vec3 way_along_side(const Found& found, const ToolPose& pose, const Twist& delta) const noexcept;
  void stay_along_side(Found& found, const ToolPose& pose) const noexcept;
  [[nodiscard]] double rounding_m(const ToolPose& pose) const noexcept;
  Twist couple(const ToolPose& pose, const Twist& e) noexcept;
  void keep_forces() noexcept;
  [[nodiscard]] static double approach(const Found& found, const ToolPose& pose, const Twist& xi) noexcept;
  [[nodiscard]] double worst_passed(const Twist& xi, const ToolPose& pose) const noexcept;
  [[nodiscard]] bool may_leave_out() const noexcept;
  bool join(const ToolPose& pose, const ToolPose& q_old, const Twist& delta, bool first, double still_m) noexcept;
  bool solve_linear(const ToolPose& pose, const Twist& e, const ToolPose& q_old, double rough, double still_m,
                    Twist& delta) noexcept;
  bool still_holds(const ToolPose& pose, const Twist& e, double still_m, Twist& delta) noexcept;
  bool solve_unbent(const Twist& e, double rough, Twist& e_coupled, Twist& delta) noexcept;
  bool solve_fewer(const ToolPose& pose, const Twist& e, double rough, Twist& delta) noexcept;
  [[nodiscard]] bool on_features() const noexcept;
  [[nodiscard]] bool stays_balanced(const Twist& delta, const Twist& e) const noexcept;
  [[nodiscard]] double normals_turn_by(const Twist& delta) const noexcept;
  [[nodiscard]] static Vec3 in_cone(Vec3 f, double mu) noexcept;  // of a contact's force, normal and across
  void balance(const Twist& e, Twist& delta) noexcept;
  [[nodiscard]] double damped(double share, const Twist& delta, const Twist& last) const noexcept;
  bool settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept;
  void share_out(bool last) noexcept;
  bool in_parts(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, ToolPose& q) noexcept;
  struct Range {
    int first = 1, last = 1;
  };
  bool go_on(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, const Range& range,
             ToolPose& q) noexcept;
  bool go_closely(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, int part, ToolPose& q) noexcept;
  struct Strides;
  enum class Strode { on, again, nowhere, to_the_end };
  [[nodiscard]] ToolPose way(const Strides& s, int part) const noexcept;
  bool go_freely(Strides& s) noexcept;
  Strode go_held(Strides& s) noexcept;
  bool in_strides(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, ToolPose& q) noexcept;
  void wait(ToolPose& q, double share, double each) noexcept;
  void stand(const ToolPose& pose, double far) noexcept;
  [[nodiscard]] double strode_m(const ToolPose& pose) const noexcept;
  [[nodiscard]] double free_m(std::uint16_t part, std::uint16_t entry, const View& at) noexcept;
  [[nodiscard]] double free_m(const ToolPose& pose, double enough) noexcept;
  void allow_for(int parts) noexcept;
  [[nodiscard]] int finer(int parts) const noexcept;
  bool in_smaller_parts(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts, ToolPose& q) noexcept;
  bool look_closely(const ToolPose& p_hat, const ToolPose& q_old, double far, int parts) noexcept;
  [[nodiscard]] bool gives_energy(const ToolPose& q_old) noexcept { return gives_energy_at(q_, q_old); }
  [[nodiscard]] bool gives_energy_at(const ToolPose& pose, const ToolPose& q_old) noexcept;
  [[nodiscard]] double bend_per_m(const Pair& pair) const noexcept;
  [[nodiscard]] double sine_of_rims(const Found& found, const ToolPose& pose) const noexcept;
  void collect_contacts(const ToolPose& pose) noexcept;
  void report(const ToolPose& q_old) noexcept;
  void judge_slips(const ToolPose& q_old, double rounding) noexcept;
  bool went_in(const ToolPose& q_old) noexcept;
  [[nodiscard]] bool may_be_in() const noexcept { return shared_->dense || let_loose_; }
  [[nodiscard]] ToolPose out_of_its_way(const ToolPose& q_old) noexcept;
  [[nodiscard]] bool stands_in(const ToolPose& pose) noexcept;
  [[nodiscard]] double overlap_m(const ToolPose& pose, const Apart& apart = {}) noexcept;
  [[nodiscard]] bool lists_leaves(const ToolPose& pose, double reach) const noexcept;
  [[nodiscard]] double overlap_of_near_leaves(std::uint16_t part, std::uint16_t entry, const View& at) const noexcept;
  [[nodiscard]] static double overlap_m(const Part& part, const Entry& entry, const View& at,
                                        const Apart& apart) noexcept;

  std::shared_ptr<const Shared> shared_;
  std::vector<double> friction_;  // of each entry, as it is now
  std::vector<Moving> moving_;    // of each entry that moves

  ToolPose q_;
  std::array<Pair, most_pairs> pairs_;
  std::size_t pair_count_ = 0;
  std::size_t still_count_ = 0;  // of them; the others are with entries that move
  ToolPose from_;                // where the sides were taken
  ToolPose gathered_at_;
  double gathered_reach_ = -1.0;
  NearLeaves near_leaves_;     // of what stands still; without room where the tool or the objects are no meshes
  double list_further_ = 2.0;  // leaves are listed so many times as far around as pairs are gathered
  std::size_t pair_room_ = most_pairs, face_room_ = most_faces, near_faces_ = 0;
  bool crowded_ = false;  // more pairs than there is room for, when they were gathered
  int budget_ = 0;        // poses that this step may still take
  int looks_ = 0;         // pairs that it may still look at
  bool closely_ = false;  // parts that give energy are taken in smaller ones
  int fewer_ = 0;         // local problems that it may still try with less
  double clearance_ = -1.0;

  std::array<Found, most_found> found_;
  std::size_t found_count_ = 0;
  double within_m_ = 0.0;  // as far the tool may move on among them
  AtPose at_pose_;         // of the pair that was looked at last
  Mat6 K_ = Mat6::Identity();
  ContactProblem problem_;
  std::array<Pressed, ContactProblem::most> pressed_;
  std::size_t pressed_count_ = 0;
  std::array<LinearContact, ContactProblem::most> linear_;
  std::array<std::uint16_t, ContactProblem::most> of_linear_{};  // in found_
  std::array<Mat3, ContactProblem::most> axes_;                  // normal and tangents, columns
  std::size_t linear_count_ = 0;

  std::array<PoseContact, ContactProblem::most> contacts_;
  // Of each contact: 1/m, 1/radius where tool or object is round; and by how many times more than the tool its normal
  // may turn.
  std::array<double, ContactProblem::most> bend_, turns_;
  std::array<std::uint16_t, ContactProblem::most> of_contact_{};  // the entries
  std::size_t count_ = 0;
  bool collected_ = false;  // of a pose before the last one that was tried
  bool unresolved_ = false, overflow_ = false, squeezed_ = false;
  bool rides_ = false;  // the last contacts are with something that moves
  static constexpr std::size_t nobody = static_cast<std::size_t>(-1);
  std::size_t riding_ = nobody;    // in moving_: what is near in this step, alone
  double extent_m_ = 0.0;          // of the coordinates of what moves
  bool without_friction_ = false;  // in the present attempt
  double behind_m_ = kFront_m;     // so far behind a feature of a cylinder may be what it holds in a part of the step
  bool bends_ = false;             // gaps' curvature counts in the present attempt
  bool lies_along_ = false;        // a side along another, pressing in the last solution
  bool let_loose_ = false;         // a pose of the iteration left all that pressed before it, in some part of the step
  bool held_ = false;              // the last local problem by the forces of the one before
  double beside_ = beside_m;       // how far beside a feature a foot may lie, in the present attempt
  double over_m_ = beside_m;       // and how far beyond a valley or an edge's end, of what pressed in the last solution
  // Of what a mesh and what isn't one may stand in each other by (they are looked at once a step).
  NearTriangles near_triangles_;  // of the last gathering
  LastPlanes last_planes_;
};

}  // namespace proxarm::models

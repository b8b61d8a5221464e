// Each broken or odd mesh file is read whole or refused with the reason. The files are written here after the formats'
// specifications (scenes/mesh_files/formats.hpp) and by nothing of the reader's: numbers are printed, bytes laid out
// one by one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "scenes/mesh_files/mesh_file.hpp"
#include "scenes/mesh_files/mesh_report.hpp"
#include "tests/scenes/mesh_files/mesh_folder.hpp"

namespace proxarm::tests {
namespace {

struct OddMesh {
  std::string name;  // of the file, with its extension
  std::string bytes;
  std::string story;
  // Either it is refused with this in the message …
  std::string refused;
  // … or it has so many triangles, is closed or not, and the report says these.
  std::size_t triangles = 0;
  bool closed = false;
  std::vector<std::string> told{};
};

// -- writers, after the specifications ----------------------------------------------------------------------------

template <typename Number>
std::string raw(Number value, bool big_endian = false) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  std::string text(bytes, sizeof value);
  return big_endian ? std::string(text.rbegin(), text.rend()) : text;
}

struct Point {
  double x, y, z;
};
using Corners = std::vector<int>;
struct Shape {
  std::vector<Point> points;
  std::vector<Corners> faces;
};

// A cube of that side about the origin, of six squares.
Shape cube(double side = 1.0) {
  const double h = 0.5 * side;
  return {{{-h, -h, -h}, {h, -h, -h}, {h, h, -h}, {-h, h, -h}, {-h, -h, h}, {h, -h, h}, {h, h, h}, {-h, h, h}},
          {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
}

Shape in_triangles(const Shape& shape) {
  Shape split{shape.points, {}};
  for (const Corners& face : shape.faces) {
    for (std::size_t k = 2; k < face.size(); ++k) split.faces.push_back({face[0], face[k - 1], face[k]});
  }
  return split;
}

// A flat plate of a × a squares, each of two triangles, without those that `left_out` names.
Shape plate(int a, const std::set<int>& left_out = {}) {
  Shape shape;
  for (int j = 0; j <= a; ++j) {
    for (int i = 0; i <= a; ++i) shape.points.push_back({0.1 * i, 0.1 * j, 0.0});
  }
  for (int s = 0; s < a * a; ++s) {
    const int at = s / a * (a + 1) + s % a;
    if (left_out.contains(s)) continue;
    shape.faces.push_back({at, at + 1, at + a + 2});
    shape.faces.push_back({at, at + a + 2, at + a + 1});
  }
  return shape;
}

// Two cones, 1 high, on either side of a circle. Each face of the upper one has the tip for itself, on a circle of that
// radius.
Shape cones_with_a_torn_tip(int faces, double tip_radius) {
  Shape shape{{{2.0, 0.0, -1.0}}, {}};
  const auto put = [&shape](double radius, double angle, double z) {
    shape.points.push_back({2.0 + radius * std::cos(angle), radius * std::sin(angle), z});
  };
  for (int i = 0; i < faces; ++i) put(1.0, 2.0 * std::numbers::pi * i / faces, 0.0);
  for (int i = 0; i < faces; ++i) put(tip_radius, 2.0 * std::numbers::pi * (i + 0.5) / faces, 1.0);
  for (int i = 0; i < faces; ++i) {
    const int here = 1 + i, next = 1 + (i + 1) % faces;
    shape.faces.push_back({here, next, 1 + faces + i});
    shape.faces.push_back({next, here, 0});
  }
  return shape;
}

// A band of n squares that is turned by half a turn before its ends meet.
Shape moebius(int n) {
  Shape shape;
  for (int i = 0; i < n; ++i) {
    const double a = 2.0 * std::numbers::pi * i / n;
    for (const double w : {-0.2, 0.2}) {
      const double r = 1.0 + w * std::cos(0.5 * a);
      shape.points.push_back({r * std::cos(a), r * std::sin(a), w * std::sin(0.5 * a)});
    }
  }
  for (int i = 0; i < n; ++i) {
    const int a = 2 * i, b = 2 * i + 1;
    const bool last = i + 1 == n;
    const int c = last ? 1 : a + 2, d = last ? 0 : b + 2;
    shape.faces.push_back({a, c, d});
    shape.faces.push_back({a, d, b});
  }
  return shape;
}

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", x);
  return text;
}

std::string obj(const Shape& shape, const char* end = "\n") {
  std::string text;
  for (const Point& p : shape.points) text += "v " + number(p.x) + " " + number(p.y) + " " + number(p.z) + end;
  for (const Corners& face : shape.faces) {
    text += "f";
    for (const int corner : face) text += " " + std::to_string(corner + 1);
    text += end;
  }
  return text;
}

std::string text_stl(const Shape& shape, const char* end = "\n") {
  std::string text = std::string("solid part") + end;
  for (const Corners& face : shape.faces) {
    text += std::string("  facet normal 0 0 0") + end + "    outer loop" + end;
    for (const int corner : face) {
      const Point& p = shape.points[static_cast<std::size_t>(corner)];
      text += "      vertex " + number(p.x) + " " + number(p.y) + " " + number(p.z) + end;
    }
    text += std::string("    endloop") + end + "  endfacet" + end;
  }
  return text + "endsolid part" + end;
}

std::string binary_stl(const Shape& shape, const std::string& head = "made by a test") {
  std::string bytes = head;
  bytes.resize(80, ' ');
  bytes += raw(static_cast<std::uint32_t>(shape.faces.size()));
  for (const Corners& face : shape.faces) {
    for (int k = 0; k < 3; ++k) bytes += raw(0.0f);
    for (const int corner : face) {
      const Point& p = shape.points[static_cast<std::size_t>(corner)];
      for (const double x : {p.x, p.y, p.z}) bytes += raw(static_cast<float>(x));
    }
    bytes += raw(std::uint16_t{0});
  }
  return bytes;
}

std::string ply_head(const std::string& format, const Shape& shape, const std::string& index = "int",
                     const std::string& end = "\n") {
  std::string text = "ply" + end + "format " + format + " 1.0" + end + "comment made by a test" + end;
  text += "element vertex " + std::to_string(shape.points.size()) + end;
  for (const char* name : {"x", "y", "z"}) text += std::string("property float ") + name + end;
  text += "element face " + std::to_string(shape.faces.size()) + end;
  return text + "property list uchar " + index + " vertex_indices" + end + "end_header" + end;
}

std::string text_ply(const Shape& shape, const std::string& end = "\n") {
  std::string text = ply_head("ascii", shape, "int", end);
  for (const Point& p : shape.points) text += number(p.x) + " " + number(p.y) + " " + number(p.z) + end;
  for (const Corners& face : shape.faces) {
    text += std::to_string(face.size());
    for (const int corner : face) text += " " + std::to_string(corner);
    text += end;
  }
  return text;
}

template <typename Index>
std::string binary_ply(const Shape& shape, const std::string& index, bool big_endian = false) {
  std::string bytes = ply_head(big_endian ? "binary_big_endian" : "binary_little_endian", shape, index);
  for (const Point& p : shape.points) {
    for (const double x : {p.x, p.y, p.z}) bytes += raw(static_cast<float>(x), big_endian);
  }
  for (const Corners& face : shape.faces) {
    bytes += raw(static_cast<std::uint8_t>(face.size()));
    for (const int corner : face) bytes += raw(static_cast<Index>(corner), big_endian);
  }
  return bytes;
}

// The cube's side as one strip of 10 corners (8 triangles), its lids as a strip each, −1 between them: as scans come.
std::string strips_ply() {
  const Shape shape = cube();
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  for (const Point& p : shape.points) text += number(p.x) + " " + number(p.y) + " " + number(p.z) + "\n";
  return text + "20 0 4 1 5 2 6 3 7 0 4 -1 0 1 3 2 -1 4 7 5 6\n";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

Shape with(Shape shape, const std::vector<Corners>& more) {
  shape.faces.insert(shape.faces.end(), more.begin(), more.end());
  return shape;
}

Shape scaled(Shape shape, double by) {
  for (Point& p : shape.points) p = {by * p.x, by * p.y, by * p.z};
  return shape;
}

Shape moved(Shape shape, double dx) {
  for (Point& p : shape.points) p.x += dx;
  return shape;
}

Shape both(const Shape& a, const Shape& b) {
  Shape joined = a;
  const int first = static_cast<int>(a.points.size());
  joined.points.insert(joined.points.end(), b.points.begin(), b.points.end());
  for (Corners face : b.faces) {
    for (int& corner : face) corner += first;
    joined.faces.push_back(face);
  }
  return joined;
}

Shape without_last_face(Shape shape) {
  shape.faces.pop_back();
  return shape;
}

Shape turned(Shape shape, std::size_t face) {
  std::swap(shape.faces[face][1], shape.faces[face][2]);
  return shape;
}

std::vector<OddMesh> odd_meshes() {
  const Shape quads = cube(), block = in_triangles(quads);
  const std::string stl = binary_stl(block), ply = text_ply(quads);
  const Shape arrow{{{0, 0, 0}, {2, 0, 0}, {1, 0.5, 0}, {2, 2, 0}, {0, 2, 0}}, {{0, 1, 2, 3, 4}}};
  const Shape bow{{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2, 3}}};
  return {
      // Strips and polygons.
      {"strips.ply",
       strips_ply(),
       "a scan in triangle strips was one triangle",
       "",
       12,
       true,
       {"12 of them out of strips"}},
      {"fans.ply", replaced(ply, "element face", "element trifans"), "an element that PLY doesn't define", "no faces"},
      {"quads.obj", obj(quads), "squares", "", 12, true, {"6 faces", "6 of them polygons"}},
      {"quads.ply", ply, "squares", "", 12, true, {"6 of them polygons"}},
      {"arrow.obj", obj(arrow), "a polygon that isn't convex: a fan would cover what is outside of it", "", 3, false},
      {"bow.obj", obj(bow), "a polygon that crosses itself", "", 2, false, {"1 polygons that cross themselves"}},
      {"four_corners.stl", text_stl(quads), "loops of four corners, which the specification doesn't have", "", 12,
       true},
      // Cut off.
      {"cut.stl", stl.substr(0, stl.size() - 75), "cut off", "it is cut off: its header says 12 triangles, and 10"},
      {"head.stl", stl.substr(0, 60), "cut off in its header", "60 bytes"},
      {"cut_text.stl", text_stl(block).substr(0, text_stl(block).size() / 2), "cut off", "it is cut off"},
      {"no_endsolid.stl", replaced(text_stl(block), "endsolid part", ""), "cut off at its last line", "it is cut off"},
      {"half.obj", obj(plate(8)).substr(0, obj(plate(8)).size() * 2 / 3), "half an OBJ was accepted", "it is cut off"},
      {"announced.obj", replaced("# Vertices: 8\n# Faces: 12\n" + obj(block), "f 1 4 3\n", ""),
       "fewer faces than its own comment says", "it is cut off: a comment says 12 faces, and 11"},
      {"cut.ply", ply.substr(0, ply.size() - 4), "cut off in its last face", "it is cut off in face 5"},
      {"cut_bytes.ply", binary_ply<std::int32_t>(block, "int").substr(0, 300), "cut off", "it is cut off"},
      {"too_many.ply", replaced(ply, "element face 6", "element face 600000000"), "a header that lies",
       "it is cut off"},
      {"more.ply", ply + "4 0 1 2 3\n", "more than its header says", "more behind its last element"},
      {"count_0.stl", replaced(stl, raw(std::uint32_t{12}), raw(std::uint32_t{0})), "a count that nobody filled in",
       "its header says 0 triangles, and there is room for 12"},
      {"endless.ply", ply.substr(0, ply.find("end_header")), "no end of its header", "no end_header"},
      {"empty.obj", "", "nothing in it", "no faces"},
      // Text.
      {"commas.obj", replaced(obj(block), "v -0.5", "v -0,5"), "decimal commas", "without a comma (1.5, not 1,5)"},
      {"commas.stl", replaced(text_stl(block), "vertex -0.5", "vertex -0,5"), "decimal commas", "without a comma"},
      {"crlf.obj", obj(block, "\r\n"), "lines that end as on Windows", "", 12, true},
      {"cr.obj", obj(block, "\r"), "lines that end as on old Macs", "", 12, true},
      {"crlf.ply", text_ply(quads, "\r\n"), "lines that end as on Windows", "", 12, true},
      {"crlf.stl", text_stl(block, "\r\n"), "lines that end as on Windows", "", 12, true},
      {"bom.obj", "\xef\xbb\xbf" + obj(block), "a byte order mark", "", 12, true},
      {"utf16.obj", std::string("\xff\xfev\0 \0", 6), "UTF-16", "UTF-16"},
      {"capitals.stl", replaced(text_stl(block), "solid part", "SOLID Part"), "capitals", "", 12, true},
      {"one_line.stl", text_stl(block, " "), "all on one line", "", 12, true},
      {"joined.obj", replaced(obj(block), "f 1 4 3", "f 1 \\\n4 3"), "a line that goes on in the next", "", 12, true},
      {"negative.obj", replaced(obj(block), "f 1 4 3", "f -8 -5 -6"), "corners counted from the end", "", 12, true},
      {"textures.obj", replaced("vt 0 0\nvn 0 0 1\n" + obj(block), "f 1 4 3", "f 1/1/1 4//1 3/1"), "v/vt/vn", "", 12,
       true},
      {"groups.obj", replaced("g\no a\ng nothing\ng\n" + obj(block), "f 1 4 3", "g x\ng y\nusemtl z\ns off\nf 1 4 3"),
       "groups with nothing in them", "", 12, true},
      {"surface.obj", obj(block) + "cstype bspline\ndeg 3 3\nsurf 0 1 0 1 1 2 3 4\n",
       "a free-form surface was left out", "free-form"},
      {"solid_binary.stl", binary_stl(block, "solid from CAD"), "binary, though it begins with \"solid\"", "", 12,
       true},
      {"tail.stl", stl + "made by a tool", "something behind the triangles", "", 12, true, {"14 bytes behind"}},
      // Numbers.
      {"nan.ply", replaced(ply, "-0.5 -0.5 -0.5", "nan -0.5 -0.5"), "not a number", "isn't finite"},
      {"nan.stl", replaced(stl, raw(0.5f), raw(std::nanf(""))), "not a number", "isn't finite"},
      {"overflow.obj", replaced(obj(block), "v -0.5", "v -1e999"), "beyond a double", "isn't finite"},
      {"huge.obj", obj(scaled(block, 1e12)), "a trillion metres", "beyond 1e9"},
      {"tiny.obj", obj(scaled(block, 1e-7)), "0.1 µm", "", 12, true, {"0.1 µm × 0.1 µm"}},
      {"beyond.obj", replaced(obj(block), "f 1 4 3", "f 1 4 30"), "a vertex that isn't there", "vertex 29"},
      {"zero.obj", replaced(obj(block), "f 1 4 3", "f 0 4 3"), "OBJ counts from 1", "vertex 0 of 8"},
      {"minus.ply", replaced(ply, "4 0 3 2 1", "4 0 -3 2 1"), "a vertex below 0", "vertex -3"},
      {"short.ply", binary_ply<std::int16_t>(block, "short"), "corners in 16 bits", "", 12, true},
      {"ushort.ply", binary_ply<std::uint16_t>(quads, "uint16"), "corners in 16 bits, as squares", "", 12, true},
      {"big_endian.ply", binary_ply<std::int32_t>(block, "int", true), "the other byte order", "", 12, true},
      {"no_z.ply", replaced(ply, "property float z", "property float w"), "vertices without z", "without one z"},
      // Geometry.
      {"flat.obj",
       replaced(obj(block), "f 1 4 3", "f 1 1 3\nf 1 4 3"),
       "a face that names a vertex twice",
       "",
       12,
       true,
       {"1 faces left out that name a vertex twice"}},
      {"needle.obj",
       "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n",
       "corners on a line",
       "",
       1,
       false,
       {"1 triangles left out whose corners are on a line"}},
      {"unused.obj",
       "v 9 9 9\n" + replaced(obj(scaled(plate(1), 1.0)), "f 1 2 4\nf 1 4 3", "f 2 3 5\nf 2 5 4"),
       "a vertex that nothing uses",
       "",
       2,
       false,
       {"1 vertices that no face uses"}},
      {"holes.obj",
       obj(plate(9, {40, 22})),
       "two holes in a plate",
       "",
       158,
       false,
       {"3 holes and borders: 100 mm at"}},
      {"moebius.obj", obj(moebius(24)), "a Möbius strip", "", 48, false, {"without a front and a back"}},
      {"flipped.obj", obj(turned(block, 5)), "a face that is turned", "", 12, false, {"1 face turned"}},
      {"inside_out.stl",
       binary_stl([&] {
         Shape out = block;
         for (Corners& face : out.faces) std::swap(face[1], face[2]);
         return out;
       }()),
       "all fronts inside",
       "",
       12,
       true,
       {"1 closed part with the fronts of all faces inside"}},
      {"fin.obj",
       obj(with(block, {{0, 6, 1}, {0, 6, 3}})),
       "edges of three faces",
       "",
       14,
       false,
       {"with more than two faces"}},
      {"crossing.obj",
       obj(both(block, moved(block, 0.3))),
       "two cubes through each other",
       "",
       24,
       true,
       {"that cross or lie on one another"}},
      {"twice.obj",
       obj(both(plate(2), plate(2))),
       "all faces twice",
       "",
       8,
       false,
       {"8 faces left out that are there already"}},
      {"open.stl",
       binary_stl(without_last_face(block)),
       "a cube without half a side",
       "",
       11,
       false,
       {"1 hole or border"}},
  };
}

class OddMeshFiles : public MeshFolder {};

TEST_F(OddMeshFiles, AreReadWholeOrRefusedWithTheReason) {
  const std::vector<OddMesh> all = odd_meshes();
  EXPECT_GE(all.size(), 40u);
  for (const OddMesh& odd : all) {
    SCOPED_TRACE(odd.name + ": " + odd.story);
    const auto file = write(odd.name, odd.bytes);
    try {
      const scenes::LoadedMesh loaded = scenes::load_mesh(file, {});
      EXPECT_EQ(odd.refused, "") << "was read";
      EXPECT_EQ(loaded.mesh->size(), odd.triangles);
      EXPECT_EQ(loaded.mesh->closed(), odd.closed);
      std::string report;
      for (const std::string& line : scenes::mesh_report(loaded)) report += line + "\n";
      for (const std::string& told : odd.told) EXPECT_THAT(report, testing::HasSubstr(told));
      // Every face is accounted for, by Euler's sum of corners: n corners are n − 2 triangles.
      const scenes::FaceAccount& account = loaded.account;
      EXPECT_GE(account.faces, account.polygons + account.unfit);
      EXPECT_GE(loaded.mesh->size() + account.flat + account.repeated + account.double_sided + account.collapsed,
                account.faces - account.unfit);
    } catch (const description::SetupError& error) {
      EXPECT_NE(odd.refused, "") << error.what();
      EXPECT_THAT(error.what(), testing::HasSubstr(odd.refused));
      EXPECT_THAT(error.what(), testing::HasSubstr(file.string()));
    }
  }
}

// A proxy, being a point, falls through a hole of any size; close_holes_m closes those that are meant.
TEST_F(OddMeshFiles, HaveHolesClosedUpToASize) {
  Shape shape = plate(9, {40, 22});
  shape = scaled(shape, 1e-3);  // holes of 0.1 mm
  const auto file = write("scan.obj", obj(shape));
  const auto open = scenes::load_mesh(file, {}).mesh;
  EXPECT_EQ(open->size(), 158u);
  const auto surprises = scenes::mesh_surprises(*open, 1.0, 1.0);
  ASSERT_FALSE(surprises.empty());
  EXPECT_THAT(surprises.back(), testing::HasSubstr("falls through 2 small holes: 100 µm at"));
  const auto closed = scenes::load_mesh(file, {.close_holes_m = 0.2e-3});
  EXPECT_EQ(closed.mesh->size(), 162u) << "its border, 0.9 mm, is none of them";
  EXPECT_EQ(closed.account.closing, 4u);
  const models::Vec3 middle(0.45e-3, 0.45e-3, 0.0), up(0.0, 0.0, 1e-3);
  EXPECT_FALSE(open->first_hit(middle + up, middle - up).any());
  EXPECT_TRUE(closed.mesh->first_hit(middle + up, middle - up).any());
  // What closes it faces as its surroundings do: nothing is flipped.
  for (const std::string& line : scenes::mesh_report(closed))
    EXPECT_THAT(line, testing::Not(testing::HasSubstr("turned")));
}

// A script that reckons a sphere's pole for each triangle makes cracks of 1e-17 m from the pole down. Nobody falls
// through them; through wider ones somebody might, and their size is what is open, not what a lid over all of it has.
TEST_F(OddMeshFiles, HaveCracksToldOfByTheirWidthAndOnlyWhereAProxyHasRoom) {
  constexpr int faces = 40;
  const auto told_of = [this](double tip_radius) {
    const auto mesh =
        scenes::load_mesh(write("torn.obj", obj(cones_with_a_torn_tip(faces, tip_radius))), {.weld_m = 0.0}).mesh;
    EXPECT_EQ(mesh->size(), 2u * faces);
    EXPECT_FALSE(mesh->closed());
    return scenes::mesh_surprises(*mesh, 1.0, 1.0);
  };
  EXPECT_THAT(told_of(1e-17), testing::IsEmpty());
  // Cracks that are 2 π 1 µm / 40 wide at their end, half of that on average, and a crack's size is twice its width.
  // The smallest cover isn't looked for: one that is half as large again is good enough.
  const auto surprises = told_of(1e-6);
  ASSERT_EQ(surprises.size(), 1u);
  const std::string before = "falls through 1 small hole: ";
  ASSERT_THAT(surprises[0], testing::HasSubstr(before));
  const double size_um = std::stod(surprises[0].substr(surprises[0].find(before) + before.size()));
  EXPECT_GT(size_um, 0.156);
  EXPECT_LT(size_um, 1.5 * 0.158);
}

TEST_F(OddMeshFiles, InAnotherUnitAreToldOfBesideTheArm) {
  const auto in_mm = scenes::load_mesh(write("mm.obj", obj(cube(300.0))), {}).mesh;
  EXPECT_THAT(scenes::mesh_surprises(*in_mm, 1.4, 1.0).at(0), testing::HasSubstr("write scale_m: 0.001"));
  const auto part = scenes::load_mesh(write("m.obj", obj(cube(0.3))), {}).mesh;
  EXPECT_TRUE(scenes::mesh_surprises(*part, 1.4, 1.0).empty());
}

}  // namespace
}  // namespace proxarm::tests

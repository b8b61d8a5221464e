"""Bad input: one clear line each, exit status 2, nothing on standard output, nothing enabled."""
import os
import shutil
import subprocess
import unittest

from harness import SOURCE, ProgramTest, program

CELL = "models/cells/default.yaml"
URDF = "models/arms/arm150.urdf"
START = "start_rad: [0, 0.0675, 0.5008, 0, 1.0025, 0]"


class Files(ProgramTest):
    def test_a_missing_file_is_named(self):
        for option in ([], ["--scene"], ["--hand"]):
            self.assert_refused(self.call("run", *option, "nowhere.yaml"), "nowhere.yaml: no such file")
        self.assert_refused(self.call("check", "nowhere.yaml"), "nowhere.yaml: no such file")

    def test_an_option_is_no_value(self):
        # The session was written to a folder named --duration=1s, and took ten seconds.
        for option in ("--record", "--black-box", "--plot", "--scene"):
            self.assert_refused(self.call("run", option, "--duration=1s"), option, "--duration=1s", "another option")

    def test_a_folder_is_no_file(self):
        for option in ([], ["--scene"], ["--hand"]):
            self.assert_refused(self.call("run", *option, "/tmp"), "/tmp: is a folder")

    def test_an_unreadable_file_is_named(self):
        file = self.written("secret.yaml", "name: secret\n")
        file.chmod(0)
        if os.access(file, os.R_OK):
            self.skipTest("this user reads files whatever their mode")
        self.assert_refused(self.call("run", "--scene", file), "secret.yaml", "permission")

    def test_a_binary_is_no_text(self):
        file = self.folder / "binary.yaml"
        file.write_bytes(b"name: \xff\xfe\x00\x01")
        for option in ([], ["--scene"], ["--hand"]):
            self.assert_refused(self.call("run", *option, file), "binary.yaml:1")

    def test_the_program_itself_is_no_cell(self):
        self.assert_refused(self.call("run", program()))

    def test_an_empty_file_is_called_empty(self):
        for option in ([], ["--scene"], ["--hand"]):
            self.assert_refused(self.call("run", *option, self.written("empty.yaml", "")), "empty.yaml", "empty")

    def test_broken_yaml_has_its_line(self):
        scene = self.written("broken.yaml", "name: open\nobjects: [\n")
        self.assert_refused(self.call("run", "--scene", scene), "broken.yaml:", "not YAML")

    def test_a_scene_may_come_through_a_pipe(self):
        reader, writer = os.pipe()
        os.write(writer, b"name: piped\n")
        os.close(writer)
        done = subprocess.run([program(), "run", "--scene", f"/dev/fd/{reader}", "--duration", "10ms", "--json"],
                              pass_fds=[reader], capture_output=True, cwd=self.folder, timeout=300)
        os.close(reader)
        self.assertEqual(done.returncode, 0, done.stderr)


class Identifiers(ProgramTest):
    """Of two owners on one bus. `check` called such cells fine; `plan` refused them without the file and its line."""
    BENCH = "models/cells/bench.yaml"
    SENSOR = "  description: ../sensors/ati_net_can_oem.yaml\n  bus: can\n  base_id: 0x12\n"

    def refuse(self, new, key, *fragments, extra=""):
        cell = self.changed(self.BENCH, (self.SENSOR, new))
        text = cell.read_text() + extra
        cell.write_text(text)
        name = key.split(".")[-1]
        line = next(i for i, line in enumerate(text.splitlines(), 1) if f"{name}:" in line)
        for command in ("check", "plan", "run", "tune", "prove"):
            with self.subTest(new, command=command):
                self.assert_refused(self.call(command, cell), f"bench.yaml:{line}: ", f": {key}: found ", *fragments)
        cell.write_text(text.replace(new, self.SENSOR, 1))

    def refuse_described(self, sensor, settings, key, *fragments):
        text = "".join(f"    {name}: {value}\n" for name, value in settings.items())
        self.refuse(f"  description: ../sensors/{sensor}.yaml\n  bus: can\n  settings:\n{text}", key, *fragments)

    def test_of_a_sensor_that_are_a_drives(self):
        self.refuse(self.SENSOR.replace("0x12", "0x18"), "sensor.base_id", "bus can", "identifier 0x181 for the force sensor",
                    "the drive of shoulder has it")
        self.refuse(self.SENSOR.replace("0x12", "0x70"), "sensor.base_id", "identifier 0x701", "the drive of shoulder")
        ids = {"command_id": "0x1F0", "first_id": "0x1F1", "second_id": "0x202"}
        self.refuse_described("robotous_rft", ids, "sensor.settings.second_id", "identifier 0x202 for the force sensor",
                              "the drive of elbow has it")

    def test_of_a_sensor_that_are_the_controllers(self):
        self.refuse(self.SENSOR.replace("0x12", "0x77"), "sensor.base_id", "identifier 0x77F", "the controller has it")
        self.refuse(self.SENSOR.replace("0x12", "0x08"), "sensor.base_id", "found 0x08", "0x09 or more")
        for command_id in ("0x080", "0x77F"):
            ids = {"command_id": command_id, "first_id": "0x1F1", "second_id": "0x1F2"}
            self.refuse_described("robotous_rft", ids, "sensor.settings.command_id", f"identifier {command_id}")

    def test_of_a_sensor_that_are_the_enabling_inputs(self):
        self.refuse(self.SENSOR.replace("0x12", "0x28"), "sensor.base_id", "identifier 0x281",
                    "the enabling input of shoulder has it", extra="enabling_input: {drive: shoulder, bit: 16}\n")

    def test_of_an_enabling_input_that_are_a_drives_or_none(self):
        text = "enabling_input: {{bus: can, identifier: {}, byte: 0, bit: 0}}\n"
        cell = self.changed(self.BENCH)
        shipped = cell.read_text()
        for identifier, owner in (("0x182", "the drive of elbow"), ("0x080", "the controller")):
            cell.write_text(shipped + text.format(identifier))
            for command in ("check", "plan", "run"):
                self.assert_refused(self.call(command, cell), f"bench.yaml:{shipped.count(chr(10)) + 1}: ",
                                    f"enabling_input.identifier: found identifier {identifier}", owner)
        # One frame more doesn't fit into the bus's millisecond, so the cell that is fine has two.
        slower = shipped.replace("default_period_s: 0.001", "default_period_s: 0.002")
        cell.write_text(slower + text.format("0x190"))
        outcome = self.call("check", cell)
        self.assertEqual((outcome.status, outcome.err), (0, ""))

    def test_that_are_shared_on_one_interface_alone(self):
        cell = self.changed(CELL, ("base_id: 0x68", "base_id: 0x18"))
        self.assertEqual(self.call("check", cell).status, 0)
        self.assertEqual(self.call("plan", cell).status, 0)
        self.assert_refused(self.call("plan", cell, "--bus", "vcan0", "--timestep", "4ms"), "default.yaml:",
                            "sensor.base_id: found identifier 0x181", "the drive of axis_1 has it")


class CellFile(ProgramTest):
    def refuse(self, old, new, *fragments):
        cell = self.changed(CELL, (old, new))
        text = cell.read_text()
        self.assert_refused(self.call("run", cell), *fragments)
        cell.write_text(text.replace(new, old, 1))

    def test_a_filter_slower_than_any_loop_can_bear(self):
        self.refuse("setpoint_bandwidth_Hz: 25", "setpoint_bandwidth_Hz: 1e-3", "limits.setpoint_bandwidth_Hz: found 1e-3",
                    "0 (no filter), or 5 to 500 Hz")

    def test_an_unknown_key_gets_the_nearest_one(self):
        self.refuse("gravity_W_m", "gravty_W_m", "default.yaml:8: gravty_W_m_per_s2: unknown key",
                    'did you mean "gravity_W_m_per_s2"')

    def test_wrong_types_and_values_show_what_was_found_and_expected(self):
        expected = "expected a number from 0 to 1000 kg"
        for value, found in (("heavy", '"heavy"'), ("-1", "-1"), (".nan", '".nan"'), (".inf", '".inf"'),
                             ("[1]", "a list"), ("", "no value")):
            self.refuse("mass_kg: 0.25", f"mass_kg: {value}", "default.yaml:12: tool.mass_kg: found " + found, expected)

    def test_whole_numbers_stay_in_their_range(self):
        self.refuse("node: 2", "node: 200", "default.yaml:56: drives[1].node: found 200", "from 1 to 127")
        self.refuse("node: 2", "node: 0", "found 0", "from 1 to 127")
        self.refuse("bitrate: 1000000", "bitrate: 7", "buses[0].bitrate: found 7", "bit/s")

    def test_a_key_that_stands_twice_is_no_choice(self):
        self.refuse("  leash_m: 0.02\n", "  leash_m: 0.02\n  leash_m: 0.03\n", "default.yaml:216", '"leash_m"', "twice",
                    "line 215")

    def test_two_drives_of_a_bus_have_two_nodes(self):
        self.refuse("node: 2", "node: 1", "default.yaml:56: drives[1].node: found 1", 'bus axes_1_3', '"axis_1"')

    def test_a_bus_must_be_one_of_the_cells(self):
        self.refuse("bus: sensor", "bus: nobus", 'sensor.bus: found "nobus"', "axes_1_3, axes_4_6 or sensor")

    def test_counts_must_fit_32_bits(self):
        self.refuse("counts_per_motor_revolution: 1048576", "counts_per_motor_revolution: 104857600",
                    "drives[0].range_rad", "32 bits")

    def test_files_that_the_cell_names_must_be_there(self):
        # `check` found nothing wrong, and `run` named the cell's folder.
        self.refuse("default_scene: ../../scenes/wall.yaml", "default_scene: lost.yaml", "default_scene", "lost.yaml",
                    "isn't there")
        cell = self.changed(CELL, ("default_scene: ../../scenes/wall.yaml", "default_scene: lost.yaml"))
        self.assert_refused(self.call("check", cell), "default_scene", "lost.yaml", "isn't there")
        cell.write_text(cell.read_text().replace("lost.yaml", "../../scenes/wall.yaml"))
        self.refuse("urdf: ../arms/arm150.urdf", "urdf: lost.urdf", "default.yaml:6: urdf", "lost.urdf", "doesn't exist")

    def test_a_joint_that_the_urdf_lacks_is_named_with_those_it_has(self):
        self.refuse("joint: axis_3", "joint: elbow", 'default.yaml:83: drives[2].joint: found "elbow"', "arm150.urdf",
                    "axis_1, axis_2, axis_3")

    def test_a_start_outside_of_a_joints_range_is_unreachable(self):
        self.refuse(START, "start_rad: [0, 5, 0.5, 0, 1, 0]", "default.yaml:9: start_rad[1]: found 5", '"axis_2"',
                    "-1.6 to 2.3 rad")

    def test_a_start_outside_of_the_workspace_or_in_a_keep_out_is_refused(self):
        """With a point and with a turning tool that has a shape: at (0.7, 0, 0.6) m."""
        limit = "limits:\n  workspace_m: {min: [0.4, -0.5, 0.3], max: [%s, 0.5, 1]}"
        zone = "limits:\n  keep_out_m: [{min: [0.6, -0.1, 0.5], max: [%s, 0.1, 0.8]}]"
        cell = self.copies() / CELL
        shipped = cell.read_text()
        for tool in ([], ["--tool", SOURCE / "scenes/tools/rod.yaml", "--inertia", "0.05"]):
            for text, outside, inside, key, expected in (
                    (limit, 0.69, 0.71, "limits.workspace_m", "a start inside of it"),
                    (zone, 0.71, 0.69, "limits.keep_out_m", "a start outside of all of them")):
                with self.subTest(key=key, tool=tool):
                    cell.write_text(shipped.replace("limits:", text % outside, 1))
                    self.assert_refused(self.call("run", cell, *tool), f"default.yaml: {key}: found the start of the tool",
                                        expected)
                    cell.write_text(shipped.replace("limits:", text % inside, 1))
                    self.summary(cell, *tool, "--duration", "100ms")

    def test_a_start_in_a_singularity_is_refused(self):
        self.refuse(START, "start_rad: [0, 0, 0, 0, 0, 0]", "start_rad", "singular", "expected a pose")
        self.refuse(START, "start_rad: [0, 0.0675, 0.5008, 0, 0, 0]", "start_rad", "singular")  # wrist stretched

    def test_defaults_of_the_cell_are_judged_as_options_are(self):
        self.refuse("default_mass_kg: 4", "default_mass_kg: 0.2", "default_mass_kg: found 0.2 kg", "0.25 kg")
        self.refuse("default_period_s: 0.001", "default_period_s: 0.0010001", "default_period_s", "60C2h")


class UrdfFile(ProgramTest):
    def refuse(self, replacements, *fragments):
        self.changed(URDF, *replacements)
        self.assert_refused(self.call("run", self.copies() / CELL), "arm150.urdf", *fragments)

    def test_without_the_named_joint(self):
        self.refuse([('name="axis_3"', 'name="axis_drei"')], 'drives[2].joint: found "axis_3"', "axis_drei")

    def test_that_is_no_xml_has_its_line(self):
        self.refuse([("</robot>", "</robo>")], "arm150.urdf:", "not XML")

    def test_with_a_link_that_is_not_there(self):
        self.refuse([('<child link="flange"', '<child link="flansch"')], "arm150.urdf:", '"flansch"')

    def test_with_an_axis_of_no_length(self):
        self.refuse([('<axis xyz="0 0 1"', '<axis xyz="0 0 0"')], "arm150.urdf:30: axis", '"0 0 0"', "not all zero")

    def test_with_a_negative_mass(self):
        file = self.copies() / URDF
        mass = file.read_text().split("<mass value=", 1)[1].split('"')[1]
        self.refuse([(f'<mass value="{mass}"', '<mass value="-1"')], "arm150.urdf:14: mass", '"-1"', "zero or more")


class SceneFile(ProgramTest):
    def refuse(self, text, *fragments):
        self.assert_refused(self.call("run", "--scene", self.written("scene.yaml", text)), "scene.yaml", *fragments)

    def test_mistakes_have_their_line(self):
        self.refuse("objects:\n  - plan: {point_m: [1, 0, 0], normal: [1, 0, 0]}\n", ":2: objects[0].plan: unknown key",
                    'did you mean "plane"')
        self.refuse("objects:\n  - plane: {point_m: [1, 0, 0], normal: [0, 0, 0]}\n", ":2:", "not all zero")
        self.refuse("objects:\n  - plane: {point_m: [1, 0, 0], normal: [-1, 0, 0], friction: -1}\n",
                    ":2: objects[0].plane.friction: found -1", "from 0 to 100")
        self.refuse("objects: 3\n", ":1: objects: found 3")
        self.refuse("dimensions: 4\n", ":1: dimensions: found 4", "from 1 to 3")
        self.refuse("dimensions: 2\n", "space")

    def test_that_the_start_is_inside_of_is_refused(self):
        self.refuse("objects:\n  - plane: {name: wall, point_m: [0.5, 0, 0.6], normal: [-1, 0, 0]}\n", ":2: wall",
                    "x 0.7000, y 0.0000, z 0.6000 m", "0.2 m inside", "free space", "start_rad")

    def test_guides_begin_at_the_tool(self):
        guide = "guide: {{line: {{point_m: [0.8, {y}, 0.6], direction: [1, 0, 0]}}}}\n"
        self.summary("--scene", self.written("near.yaml", guide.format(y=0.00005)), "--duration", "0.2s")
        self.refuse(guide.format(y=0.015), ":1: guide", "0.015 m away", "start_rad")

    def refuse_each(self, rows):
        for text, *fragments in rows:
            with self.subTest(text=text):
                self.refuse(text, *fragments)

    def test_each_kind_refuses_what_is_no_number_or_no_shape(self):
        def object_of(kind, keys):
            return f"objects:\n  - {kind}: {{{keys}}}\n"
        rows = []
        sound = {
            "plane": ("point_m: [1, 0, 0]", "normal: [-1, 0, 0]"),
            "box": ("centre_m: [1, 0, 0]", "size_m: [0.1, 0.1, 0.1]"),
            "sphere": ("centre_m: [1, 0, 0]", "radius_m: 0.1"),
            "capsule": ("from_m: [1, 0, 0]", "to_m: [1, 0, 1]", "radius_m: 0.1"),
            "cylinder": ("from_m: [1, 0, 0]", "to_m: [1, 0, 1]", "radius_m: 0.1"),
        }
        for kind, keys in sound.items():
            place = f":2: objects[0].{kind}."
            for index, pair in enumerate(keys):
                key, value = pair.split(": ", 1)
                for found in (".nan", ".inf", "-.inf"):
                    # Of a list the first number is the bad one.
                    changed = value.replace("[1,", f"[{found},").replace("[-1,", f"[{found},")
                    changed = changed.replace("[0.1,", f"[{found},").replace("0.1", found) if changed == value else changed
                    others = [other for k, other in enumerate(keys) if k != index]
                    rows.append((object_of(kind, ", ".join([f"{key}: {changed}", *others])), place + key, found, "expected"))
            rest = ", ".join(keys)
            rows.append((object_of(kind, rest + ", friction: -0.1"), place + "friction: found -0.1", "from 0 to 100"))
            rows.append((object_of(kind, rest + ", friction: .nan"), place + "friction", ".nan", "from 0 to 100"))
            for motion, key, expected in (("velocity_m_per_s: [0, .nan, 0]", "velocity_m_per_s", "-100 to 100"),
                                          ("swing: {amplitude_m: [1, 0, 0], frequency_Hz: 0}", "frequency_Hz", "found 0"),
                                          ("turn: {axis: [0, 0, 0], centre_m: [0, 0, 0], speed_rad_per_s: 1}", "axis",
                                           "not all zero")):
                rows.append((object_of(kind, rest + f", motion: {{{motion}}}"), place + "motion.", key, expected))
            for layer, key in (("thickness_m: 0, stiffness_N_per_m: 1", "thickness_m: found 0"),
                               ("thickness_m: 0.001, stiffness_N_per_m: .inf", "stiffness_N_per_m")):
                rows.append((object_of(kind, rest + f", layer: {{{layer}}}"), place + "layer." + key, "expected"))
        for kind, keys, key in (("plane", "point_m: [1, 0, 0], normal: [0, 0, 0]", "normal"),
                                ("box", "centre_m: [1, 0, 0], size_m: [0.1, 0, 0.1]", "size_m"),
                                ("sphere", "centre_m: [1, 0, 0], radius_m: -1", "radius_m: found -1"),
                                ("capsule", "from_m: [1, 0, 0], to_m: [1, 0, 1], radius_m: 0", "radius_m: found 0"),
                                ("cylinder", "from_m: [1, 0, 0], to_m: [1, 0, 0], radius_m: 0.1", "to_m")):
            rows.append((object_of(kind, keys), f":2: objects[0].{kind}.{key}", "expected"))
        self.refuse_each(rows)

    def test_meshes_that_are_none(self):
        rows = []
        for name, text in (("empty.stl", ""), ("none.obj", "v 0 0 0\n"), ("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
                           ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
                           ("nan.obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")):
            self.written(name, text)
            rows.append((f"objects:\n  - mesh: {{file: {name}}}\n", name))
        rows.append(("objects:\n  - mesh: {file: lost.stl}\n", "lost.stl"))
        for text, name in rows:
            with self.subTest(mesh=name):
                outcome = self.call("run", "--scene", self.written("scene.yaml", text))
                expected = {"lost.stl": ":2: objects[0].mesh.file", "flat.obj": "none of the triangles has an area"}
                self.assert_refused(outcome, name, expected.get(name, "expected a mesh"))

    def test_meshes_whose_faces_cross(self):
        """Two cubes in one file that stand in each other: as an object beside a rigid tool, and as the tool. A point is
        held by each face, whatever the others do."""
        corners = [(100 * (k & 1), 50 * (k & 2), 25 * (k & 4)) for k in range(8)]
        faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
        text = ""
        for shift in (0, 30):
            text += "".join("v %d %d %d\n" % tuple(x + shift for x in c) for c in corners)
        for first in (0, 8):
            text += "".join("f %d %d %d %d\n" % tuple(i + first for i in f) for f in faces)
        self.written("crossing.obj", text)
        told = "crossing.obj, %s faces that cross or lie on one another: 18 pairs, the first at x %s"
        repair = "in the program that made it, unite what overlaps"
        objects = "objects:\n  - mesh: {file: crossing.obj, scale_m: 0.001, position_m: [2, 0, 0]}\n"
        beside = self.written("beside.yaml", "dimensions: 3\ntool: {sphere: {radius_m: 0.01}}\n" + objects)
        tool = self.written("tool.yaml", "mesh: {file: crossing.obj, scale_m: 0.001}\n")
        for command in (["run", "--inertia", "0.05", "--scene"], ["check"]):
            self.assert_refused(self.call(*command, beside), "beside.yaml:4", told % ("has", "2"), repair)
        self.assert_refused(self.call("run", "--inertia", "0.05", "--tool", tool), "tool.yaml:1",
                            told % ("which has", "0.1"), repair)
        self.assert_refused(self.call("check", tool), "tool.yaml:1", told % ("which has", "0.1"), repair)
        self.assertEqual(self.call("run", "--scene", self.written("point.yaml", objects), "--duration", "10ms").status, 0)

    def test_a_start_inside_of_each_kind(self):
        self.written("cube.obj", "".join(f"v {0.6 + 0.2 * (k & 1)} {-0.1 + 0.1 * (k & 2)} {0.5 + 0.05 * (k & 4)}\n" for k in range(8)) +
                     "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n")
        solids = {
            "plane": "point_m: [0.65, 0, 0.6], normal: [-1, 0, 0]",
            "box": "centre_m: [0.7, 0, 0.6], size_m: [0.1, 0.1, 0.1]",
            "sphere": "centre_m: [0.7, 0, 0.6], radius_m: 0.05",
            "capsule": "from_m: [0.7, 0, 0.4], to_m: [0.7, 0, 0.8], radius_m: 0.05",
            "cylinder": "from_m: [0.7, 0, 0.4], to_m: [0.7, 0, 0.8], radius_m: 0.05",
            "mesh": "file: cube.obj",
        }
        rooms = {
            "box": "centre_m: [1, 0, 0.6], size_m: [0.5, 0.1, 0.1], inside_out: true",
            "sphere": "centre_m: [1, 0, 0.6], radius_m: 0.25, inside_out: true",
            "capsule": "from_m: [1, 0, 0.4], to_m: [1, 0, 0.8], radius_m: 0.25, inside_out: true",
            "cylinder": "from_m: [1, 0, 0.4], to_m: [1, 0, 0.8], radius_m: 0.25, inside_out: true",
            "mesh": "file: cube.obj, position_m: [0.3, 0, 0], inside_out: true",
        }
        message = (":2: it", "x 0.7000, y 0.0000, z 0.6000 m", "inside", "free space", "start_rad")
        rows = []
        for shapes in (solids, rooms):
            for kind, keys in shapes.items():
                for more in ("", ", motion: {velocity_m_per_s: [0.1, 0, 0]}", ", motion: {driven: true}",
                             ", layer: {thickness_m: 0.01, stiffness_N_per_m: 1000}"):
                    if kind == "mesh" and "layer" in more:
                        continue
                    rows.append((f"objects:\n  - {kind}: {{name: it, {keys}{more}}}\n", *message))
        # In a plane and on a line, too.
        for space in ("dimensions: 2\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0], [0, 1, 0]]}\n",
                      "dimensions: 1\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0]]}\n"):
            for kind, keys in solids.items():
                rows.append((f"{space}objects:\n  - {kind}: {{name: it, {keys}}}\n", ":4: it", *message[1:]))
        # Within its layer it is where a proxy may be.
        self.refuse_each(rows)
        skin = self.written("skin.yaml", "objects:\n  - sphere: {centre_m: [0.745, 0, 0.6], radius_m: 0.05, "
                                         "layer: {thickness_m: 0.01, stiffness_N_per_m: 1000}}\n")
        self.summary("--scene", skin, "--duration", "0.1s")

    def test_guides_that_are_none_or_elsewhere(self):
        rows = []
        for kind, keys, key in (("line", "point_m: [.nan, 0, 0.6], direction: [1, 0, 0]", "point_m"),
                                ("line", "point_m: [0.7, 0, 0.6], direction: [0, 0, 0]", "direction"),
                                ("plane", "point_m: [0.7, 0, 0.6], normal: [0, 0, 0]", "normal"),
                                ("plane", "point_m: [0.7, 0, 0.6], normal: [0, .inf, 0]", "normal"),
                                ("polyline", "points_m: [[0.7, 0, 0.6]]", "points_m"),
                                ("polyline", "points_m: [[0.7, 0, 0.6], [0.7, .nan, 0.6]]", "points_m"),
                                ("polyline", "points_m: [[0.7, 0, 0.6], [0.7, 0, 0.6]]", "points_m")):
            rows.append((f"guide: {{{kind}: {{{keys}}}}}\n", f":1: guide.{kind}.{key}", "expected"))
            rows.append((f"guide: {{{kind}: {{{keys}, friction: -1}}}}\n", "expected"))
        for kind, keys in (("line", "point_m: [0.8, 0.02, 0.6], direction: [1, 0, 0]"),
                           ("plane", "point_m: [0.8, 0.02, 0.6], normal: [0, 1, 0]"),
                           ("polyline", "points_m: [[0.6, 0.02, 0.6], [0.8, 0.02, 0.6]]")):
            guide = f"guide: {{{kind}: {{{keys}}}}}\n"
            ball = "objects:\n  - sphere: {centre_m: [1, 0, 0.6], radius_m: 0.1}\n"
            pushing = ball.replace("0.1}", "0.1, motion: {driven: true}}")
            flat = "dimensions: 2\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0], [0, 1, 0]]}\n"
            for before, line in (("", 1), (ball, 3), (pushing, 3), (flat, 3)):
                rows.append((before + guide, f":{line}: guide", "0.02 m away", "start_rad"))
        self.refuse_each(rows)

    def test_what_moves_and_leaves_no_room_is_a_fault(self):
        wall = "  - plane: {point_m: [0.72, 0, 0.6], normal: [-1, 0, 0]}\n"
        press = "objects:\n  - box: {centre_m: [0.6, 0, 0.6], size_m: [0.1, 0.1, 0.1], motion: {velocity_m_per_s: [0.1, 0, 0]}}\n"
        rail = "guide: {polyline: {points_m: [[0.5, 0, 0.6], [0.72, 0, 0.6]]}}\n"
        flat = "dimensions: 2\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0], [0, 1, 0]]}\n"
        for text in (press + wall, press + rail, press + wall + rail, flat + press + rail,
                     "dimensions: 1\nspace: {origin_m: [0.7, 0, 0.6], axes: [[1, 0, 0]]}\n" + press + wall):
            with self.subTest(text=text):
                outcome = self.call("run", "--scene", self.written("scene.yaml", text), "--duration", "2s", "--json")
                self.assertEqual(outcome.status, 1, outcome.err + outcome.out)
                self.assertIn("proxy_squeezed", outcome.out)
                self.assertNotIn("nan", outcome.out.lower().replace("name", ""))

    def test_that_begins_at_the_start_is_fine_up_to_a_tenth_of_a_millimetre(self):
        wall = "objects:\n  - plane: {{point_m: [{x}, 0, 0], normal: [-1, 0, 0]}}\n"
        # The start is at 0.70000 to within 0.02 mm.
        self.summary("--scene", self.written("near.yaml", wall.format(x=0.69995)), "--duration", "0.2s")
        self.refuse(wall.format(x=0.69985), "inside")

    def test_without_any_free_place_is_refused_at_its_deepest_object(self):
        self.refuse("objects:\n  - plane: {name: front, point_m: [0.71, 0, 0], normal: [-1, 0, 0]}\n"
                    "  - plane: {name: back, point_m: [0.74, 0, 0], normal: [1, 0, 0]}\n", ":3: back", "0.04 m inside")


class Options(ProgramTest):
    def refuse(self, *arguments_and_fragments):
        arguments, fragments = arguments_and_fragments[0], arguments_and_fragments[1:]
        self.assert_refused(self.call(*arguments.split()), *fragments)

    def test_a_number_without_its_unit_is_ambiguous(self):
        self.refuse("run --timestep 1", '--timestep: found "1"', "the unit is missing", "1ms")
        self.refuse("run --duration 10", '--duration: found "10"', "the unit is missing")

    def test_durations_are_above_zero(self):
        for value in ("0ms", "-1ms", "nan", "inf", "1e999s", "ms", "1 parsec"):
            self.assert_refused(self.call("run", f"--timestep={value}"), "--timestep")
        for value in ("0s", "-1s", "nan"):
            self.assert_refused(self.call("run", f"--duration={value}"), "--duration")

    def test_half_a_millisecond_is_refused_with_the_arithmetic(self):
        self.refuse("run --timestep 0.5ms", "--timestep", "bus axes_1_3", "810 bits", "1 Mbit/s", "810 us", "500 us",
                    "would fit", "1 ms", "CAN FD")

    # It was "--timestep" whoever had asked for it, and `tune` gave advice for a timestep that no bus could carry.
    def test_a_timestep_that_a_bus_can_not_carry_is_told_by_who_asked_for_it(self):
        for command in ("run", "tune", "prove", "assess"):
            with self.subTest(command):
                self.refuse(f"{command} --timestep 0.3ms", "--timestep: bus axes_1_3 can't carry a timestep of 0.3 ms",
                            "`proxarm plan` shows each frame")
                cell = self.changed(CELL, ("default_period_s: 0.001", "default_period_s: 0.0005"))
                line = cell.read_text().split("default_period_s")[0].count("\n") + 1
                outcome = self.call(command, cell)
                self.assert_refused(outcome, f"default.yaml:{line}: default_period_s: bus axes_1_3 can't carry a timestep of "
                                             "0.5 ms")
                self.assertNotIn("--timestep", outcome.err)
                cell.unlink()
                shutil.copy(SOURCE / CELL, cell)
        bench = self.changed("models/cells/bench.yaml", ("default_period_s: 0.001\n", ""), ("receive_window: 0.55", ""))
        self.assert_refused(self.call("run", bench), "bench.yaml: default_period_s: bus can can't carry a timestep of 1 ms")

    def test_timesteps_that_drives_can_not_hold(self):
        self.refuse("run --timestep 1.0001ms", "--timestep: found 1.0001 ms", "60C2h", "such as 0.5ms, 1ms")
        self.refuse("run --timestep 2.57ms", "--timestep: found 2.57 ms", "60C2h")  # 257 units: one byte holds 255
        self.refuse("run --timestep 1ns", "--timestep", "0.05 to 100 ms")
        self.refuse("run --timestep 10s", "--timestep: found 10000 ms", "0.05 to 100 ms")

    def test_masses_that_nobody_can_feel(self):
        for value in ("0", "-1", "nan", "inf", "4x", "-inf"):
            self.assert_refused(self.call("run", f"--mass={value}"), "--mass", "mass above zero")
        for value in ("0.25", "0.1", "250g"):
            self.assert_refused(self.call("run", "--mass", value), "--mass", "more than the handle's own 0.25 kg")

    def test_an_unstable_mass_names_the_smallest_that_is_not(self):
        outcome = self.call("run", "--mass", "0.5")
        self.assert_refused(outcome, "--mass: found 0.5 kg", "expected at least", "--force-unstable", "500 N/m",
                            "20 Ns/m", "1 kg")
        smallest = outcome.err.split("at least ")[1].split(" kg")[0]
        self.assertLess(float(smallest), 2.0)
        self.summary("--mass", smallest, "--duration", "0.1s")
        forced = self.call("run", "--mass", "0.5", "--force-unstable", "--duration", "0.1s", "--json")
        self.assertIn(forced.status, (0, 1), forced.err)
        self.refuse("run --mass 0.2 --force-unstable", "0.25 kg")
        self.refuse("run --force-unstable --bus vcan0", "--force-unstable", "--bus sim")

    def test_words_and_numbers_that_an_option_does_not_know(self):
        self.refuse("run --pace fast", '--pace: found "fast", expected realtime or virtual')
        self.refuse("run --order 3", '--order: found "3", expected 1 or 2')
        self.refuse("run --orientation up", '--orientation: found "up", expected free or held')
        self.refuse("run --damping -1", '--damping: found "-1"', "Ns/m")
        self.refuse("run --spring nan", '--spring: found "nan"', "N/m")

    def test_unknown_commands_and_options_get_the_nearest_one(self):
        self.refuse("runn", 'found "runn"', "did you mean run?")
        self.refuse("run --massa 3", 'unknown option "--massa"', "did you mean --mass?")
        self.refuse("run --mass", "--mass")
        self.refuse("run one.yaml two.yaml", "two.yaml")
        self.refuse("check", "files")
        self.assert_refused(self.call(), "found no command", "expected run, sim, plan, ")

    def test_help_and_version_are_no_mistakes(self):
        for arguments in (["--help"], ["--version"], ["run", "--help"], ["sim", "--help"]):
            outcome = self.call(*arguments)
            self.assertEqual((outcome.status, outcome.err), (0, ""))
        self.assertIn("--fault", self.call("run", "--help").out)
        self.assertIn("--fault", self.call("sim", "--help").out)

    def test_a_record_never_overwrites_what_is_not_one(self):
        self.assert_refused(self.call("run", "--record", SOURCE / "scenes"), "--record", "scenes")
        self.assert_refused(self.call("run", "--record", program()), "--record")
        self.assert_refused(self.call("run", "--record", "/proc/nowhere"), "--record", "/proc/nowhere")

    def test_a_fault_that_its_bus_does_not_know(self):
        rail = SOURCE / "models/cells/rail.yaml"
        outcome = self.call("run", rail, "--fault", "rail:sdo@1s")
        self.assert_refused(outcome, "sdo for rail", "for a drive on Modbus", "half_answer")
        self.assert_refused(self.call("run", "--fault", "axis_1:closed@1s"), "closed for axis_1", "a drive on CAN")
        self.assert_refused(self.call("run", "--fault", "sensor:checksum@1s"), "sensor:checksum", "have none")
        self.assert_refused(self.call("run", "--fault", "axis_1:fault=0x14210@1s"), "0 to 65535")

    def test_a_scheme_that_the_drives_cannot_serve(self):
        light = SOURCE / "models/cells/light.yaml"
        self.assert_refused(self.call("run", "--scheme", "impedance"), "--scheme", "axis_1 takes positions")
        self.assert_refused(self.call("run", light, "--scheme", "admittance"), "--scheme", "turn takes torques")
        self.assert_refused(self.call("run", "--stiffness", "300"), "--stiffness", "--scheme impedance")
        for option in (("--mass", "3"), ("--spring", "100"), ("--order", "2"), ("--orientation", "free")):
            self.assert_refused(self.call("run", light, *option), option[0], "impedance type")
        self.assert_refused(self.call("run", light, "--stiffness", "20000"), "damping above 30 Ns/m", "0.368 kg")
        self.assert_refused(self.call("tune", light), "impedance type")

    def test_check_opens_what_a_cell_names(self):
        for shipped in ("drives/generic_absolute.yaml", "drives/simulated_drive.eds", "cells/light.yaml"):
            self.assertEqual(self.call("check", SOURCE / "models" / shipped).status, 0)
        registers = (SOURCE / "models/drives/generic_absolute.yaml").read_text()
        (self.folder / "own.yaml").write_text(registers.replace("register: 32,", "register: 4,"))
        rail = (SOURCE / "models/cells/rail.yaml").read_text()
        for path in ("../arms", "../../scenes", "../../sim", "../sensors"):
            rail = rail.replace(path + "/", str((SOURCE / "models/cells" / path).resolve()) + "/")
        (self.folder / "cell.yaml").write_text(rail.replace("../drives/generic_absolute.yaml", "own.yaml"))
        for file in ("own.yaml", "cell.yaml"):
            self.assert_refused(self.call("check", file), "own.yaml:", "settings[0].register", "overlap")

    def test_check_tries_as_many_states_as_it_is_told(self):
        scene = SOURCE / "scenes/room.yaml"
        first, again, other = (self.call("check", scene, "--states", "500", "--depth", "3mm", "--seed", seed)
                               for seed in ("7", "7", "8"))
        self.assertEqual((first.status, first.out), (0, again.out))
        self.assertIn("room: fine in 500 states", first.out)
        self.assertNotEqual(first.out, other.out)
        for option, value in (("--states", "0"), ("--states", "many"), ("--seed", "-1"), ("--depth", "5"),
                              ("--depth", "-5mm")):
            self.assert_refused(self.call("check", scene, option, value), option)

    def test_check_reads_dbc_files(self):
        good = self.written("sensor.dbc", 'VERSION ""\nBO_ 291 FORCE: 6 X\n SG_ Fx : 7|16@0- (0.01,0) [-300|300] "N" X\n')
        self.assertEqual(self.call("check", good).status, 0)
        bad = self.written("bad.dbc", 'BO_ 291 FORCE: 6 X\n SG_ Fx : 47|16@0- (0.01,0) [-300|300] "N" X\n')
        self.assert_refused(self.call("check", bad), "bad.dbc:2", "within the 6 bytes of FORCE")

    def test_a_session_lasts_at_most_a_week(self):
        self.assert_refused(self.call("run", "--duration", "1e30s"), "--duration", "at most a week")

    def test_a_plot_needs_a_folder_that_is_there(self):
        self.assert_refused(self.call("run", "--plot", "nowhere/plot.svg"), "--plot", "nowhere")

    def test_a_plot_overwrites_nothing_but_a_plot(self):
        scene = self.written("scene.yaml", "name: mine\n")
        self.assert_refused(self.call("run", "--plot", scene), "--plot", "ends in .svg")
        self.assertEqual(scene.read_text(), "name: mine\n")
        (self.folder / "folder.svg").mkdir()
        self.assert_refused(self.call("run", "--plot", self.folder / "folder.svg"), "--plot", "can be written")

    def test_a_plot_that_cannot_be_drawn_is_no_success(self):
        outcome = self.call("run", "--duration", "0.1s", "--plot", self.folder / "plot.svg", env={"PATH": "/nowhere"})
        self.assertEqual(outcome.status, 2)
        self.assertIn("gnuplot isn't installed", outcome.err)
        self.assertFalse((self.folder / "plot.svg").exists())

    def test_a_folder_is_no_file(self):
        self.assert_refused(self.call("check", SOURCE / "scenes"), "scenes", "is a folder")

    def test_a_plane_that_the_tool_is_not_in(self):
        scene = self.changed("scenes/plane_2d.yaml", ("origin_m: [0.7, 0, 0.6]", "origin_m: [0.7, 0, 0.5]"))
        self.assert_refused(self.call("run", "--scene", scene), "plane_2d.yaml", "space", "0.1 m beside it")


class Buses(ProgramTest):
    def test_mappings(self):
        for text in ("", ",", "a,b", "a=b=c", "=can0", "axes_1_3=", "sim,sim"):
            self.assert_refused(self.call("run", f"--bus={text}"), "--bus")
        self.assert_refused(self.call("run", "--bus", "axes_1_3=x=y"), "--bus: found 'axes_1_3=x=y'", "NAME=INTERFACE")
        self.assert_refused(self.call("run", "--bus", "nobus=vcan0"), "'nobus'", "axes_1_3, axes_4_6, sensor")
        self.assert_refused(self.call("run", "--bus", "axes_1_3=vcan0"), "no interface for 'axes_4_6'")
        self.assert_refused(self.call("run", "--bus", "sensor=a,sensor=b"), "'sensor' twice")

    def test_an_interface_that_is_not_there(self):
        # Where the kernel has no CAN at all, that is what it says.
        for command in ("run", "sim"):
            outcome = self.call(command, "--bus", "nocan7")
            self.assert_refused(outcome, "bus nocan7")
            self.assertTrue("no CAN" in outcome.err or "no such" in outcome.err or "exist" in outcome.err, outcome.err)

    def test_loopback_is_no_can_interface(self):
        self.assert_refused(self.call("run", "--bus", "lo"), "bus lo")

    def test_one_node_twice_on_one_interface(self):
        cell = self.changed(CELL, ("node: 4", "node: 1"))
        self.summary(cell, "--duration", "10ms")  # on buses of their own that is fine
        mapping = "axes_1_3=vcan0,axes_4_6=vcan0,sensor=vcan1"
        for command in ("run", "sim"):
            self.assert_refused(self.call(command, cell, "--bus", mapping), "bus vcan0", "node 1", "axis_1", "axis_4")

    def test_virtual_time_is_for_simulated_buses(self):
        self.assert_refused(self.call("run", "--pace", "virtual", "--bus", "vcan0"), "--pace", "realtime")

    def test_the_simulated_arm_alone_needs_interfaces(self):
        for arguments in (["sim"], ["sim", "--bus", "sim"]):
            self.assert_refused(self.call(*arguments), "--bus", "proxarm run")


class Devices(ProgramTest):
    """What bring-up finds: bus, node, object and what to do; no drive is ever enabled."""

    def refuse(self, fault, *fragments):
        record = self.folder / "record"
        outcome = self.call("run", "--json", "--fault", fault, "--record", record, "--duration", "10ms")
        self.assert_refused(outcome, *fragments)
        for line in (record / "frames.log").read_text().splitlines():
            identifier, _, data = line.split(" ")[2].partition("#")
            self.assertFalse(0x201 <= int(identifier, 16) <= 0x27F, line)  # RPDO1, where the controlword is
            self.assertNotEqual(data[:2] if identifier == "000" else "", "01", line)  # NMT start

    def test_a_drive_that_does_not_answer(self):
        self.refuse("axis_2:silent", "bus axes_1_3, node 2, object 1000h:00", "axis_2", "no answer", "powered")
        self.refuse("axis_5:sdo", "bus axes_4_6, node 5", "axis_5")
        self.refuse("axis_6:power", "bus axes_4_6, node 6", "no answer")

    def test_a_drive_with_another_device_type(self):
        self.refuse("axis_4:device_type=0x00030192", "bus axes_4_6, node 4, object 1000h:00", "found 0x00030192",
                    "expected 0x00020192", "device_type")

    def test_a_sensor_that_is_silent(self):
        self.refuse("sensor:silent", "bus sensor", "base id 0x68", "no answer", "powered")
        self.refuse("sensor:samples", "bus sensor", "no whole sample")
        self.refuse("sensor:short", "bus sensor", "wrong length")
        self.refuse("sensor:status=0x4000", "bus sensor", "status", "expected no error")

    def test_faults_are_for_simulated_devices(self):
        self.assert_refused(self.call("run", "--fault", "axis_1:silent", "--bus", "vcan0"), "--fault", "proxarm sim")

    def test_faults_that_are_misspelt(self):
        self.assert_refused(self.call("run", "--fault", "axis_9:silent"), '"axis_9"', "axis_1", "sensor")
        self.assert_refused(self.call("run", "--fault", "silent"), '"silent"', "DEVICE:KIND")
        self.assert_refused(self.call("run", "--fault", "axis_1:loud"), '"axis_1:loud"', "silent")
        self.assert_refused(self.call("run", "--fault", "axis_1:silent@1"), "unit")
        self.assert_refused(self.call("run", "--fault", "sensor:silent=3"), "no value")


if __name__ == "__main__":
    unittest.main(verbosity=2)

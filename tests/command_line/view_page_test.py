"""The page of the view in a real browser: what stands in its scene graph, and what is to be seen in its pixels."""
import csv
import json
import math
import os
import re
import time
import unittest

import view_browser
from harness import SOURCE, ProgramTest
from timing_test import bumpy_ball
from view_browser import pixels
from view_client import Session

FIRST_MOMENT = 'window.proxarm && performance.getEntriesByName("first-moment").length > 0'
NOW = "proxarm.plots.rows[proxarm.plots.rows.length - 1]"

# A region of each kind that a medium may be within.
REGIONS = """name: regions
media:
  - viscous: {damping_Ns_per_m: 20, within: {plane: {point_m: [0.7, 0, 0.5], normal: [0, 0, 1]}}}
  - viscous: {damping_Ns_per_m: 20, within: {box: {centre_m: [0.9, 0.3, 0.6], size_m: [0.1, 0.2, 0.3]}}}
  - viscous: {damping_Ns_per_m: 20, within: {sphere: {centre_m: [0.9, 0, 0.8], radius_m: 0.1}}}
  - viscous: {damping_Ns_per_m: 20, within: {capsule: {from_m: [0.6, -0.3, 0.6], to_m: [0.8, -0.3, 0.6], radius_m: 0.05}}}
  - viscous: {damping_Ns_per_m: 20, within: {cylinder: {from_m: [0.6, 0.3, 0.6], to_m: [0.8, 0.3, 0.6], radius_m: 0.05}}}
  - viscous: {damping_Ns_per_m: 1}
"""


class Page(ProgramTest):
    def setUp(self):
        super().setUp()
        if reason := view_browser.why_not():
            self.skipTest(reason)
        if os.environ.get("PROXARM_SLOW_BUILD"):
            self.skipTest("a browser beside sanitizers has no time to draw")

    def opened(self, browser, session):
        browser.open(session.url)
        browser.until(FIRST_MOMENT, "the first moment")

    def until_time(self, browser, seconds):
        browser.until(f"proxarm.plots.rows.length && {NOW}.time_s >= {seconds}", f"{seconds} s of the session")

    def point_of(self, browser, x, y, z):
        """Where a point of W is in the picture of the page, in pixels."""
        return browser.run("""
            const { world } = proxarm, box = world.canvas.getBoundingClientRect();
            const p = world.middle.clone().set(...arguments).project(world.camera);
            return [box.left + (0.5 + p.x / 2) * box.width, box.top + (0.5 - p.y / 2) * box.height];""", x, y, z)

    def assert_colour(self, picture, point, is_it, what):
        rows, step = pixels(picture)
        x, y = (round(c) for c in point)
        around = [tuple(rows[j][step * i:step * i + 3]) for j in range(y - 3, y + 4) for i in range(x - 3, x + 4)]
        self.assertTrue(any(is_it(*colour) for colour in around), f"{what} at {x}, {y}: {around[24]}")

    def test_the_default_run_at_the_touch(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            self.until_time(browser, 4.4)
            names = browser.run("""const found = []; proxarm.world.scene.traverseVisible((o) => found.push(o.name));
                                   return found;""")
            for name in ("arm", "link_6", "handle", "wall", "sheet", "proxy", "tool", "normal", "friction cone"):
                self.assertIn(name, names)
            self.assertTrue({"stick force", "slip force"} & set(names), "a force's arrow at the touch")
            # The last link is where the moment has it, and the proxy at the wall.
            place = browser.run("return proxarm.world.contacts.proxy.position.toArray()")
            self.assertAlmostEqual(place[0], 0.9, delta=1e-3)
            rows = browser.run("return proxarm.plots.rows.length")
            # As fine as it gets, for whoever looks at the picture.
            browser.run("proxarm.world.ratioStep = 0; proxarm.world.adapt = () => {}; proxarm.world.resize()")
            browser.until("proxarm.world.canvas.width >= 900", "a fine picture")
            time.sleep(0.3)
            picture = browser.picture("touch-light")
            self.assertGreater(browser.run("return proxarm.plots.rows.length"), rows, "plots that move")
            self.assert_colour(picture, self.point_of(browser, 0.9, 0.35, 0.75),
                               lambda r, g, b: g > r + 8 and g > b + 2, "the wall's green")
            self.assert_colour(picture, self.point_of(browser, 0.0, 0.0, 0.1),
                               lambda r, g, b: abs(r - g) < 40 and 60 < g < 250, "the arm's foot")
            self.assert_colour(picture, (200, 160), lambda r, g, b: min(r, g, b) > 205, "nothing beside the arm")
            self.assert_everything_is_readable(browser)
            self.assertEqual(browser.run("return document.getElementById('control').hidden"), True)
            self.assertEqual(browser.run("return document.getElementById('phase-chip').textContent"), "rendering")
            self.assertEqual(browser.complaints(), [])

    def assert_everything_is_readable(self, browser):
        """Each plot has the names of all its lines within its width, and no button lies over the arm."""
        for told, wanted, ends, width in browser.run("""
                return proxarm.plots.plots.filter((plot) => plot.width).map((plot) => [
                  plot.head.slice(1).map((piece) => piece.text), plot.description.lines.map((line) => line.name),
                  Math.max(...plot.head.map((piece) => piece.x + piece.width)), plot.width]);"""):
            self.assertEqual(told[:len(wanted)], wanted)
            self.assertLessEqual(ends, width)
        heads = browser.run("return proxarm.plots.plots.map((plot) => plot.head?.map((piece) => piece.text))")
        if any("computing" in (head or [""])[0] for head in heads if head):
            self.assertRegex(heads[3][-1], r"^(no overrun|1 overrun|\d+ overruns|over the period: [\d.]+ ms)$")
        top, bottom, above, below = browser.run("""
            const { world } = proxarm, box = world.canvas.getBoundingClientRect(), point = world.middle.clone();
            let top = Infinity, bottom = -Infinity;
            world.arm.traverse((part) => {
              if (!part.isMesh) return;
              const { position } = part.geometry.attributes;
              for (let i = 0; i < position.count; ++i) {
                point.fromBufferAttribute(position, i).applyMatrix4(part.matrixWorld).project(world.camera);
                const y = box.top + (0.5 - point.y / 2) * box.height;
                top = Math.min(top, y);
                bottom = Math.max(bottom, y);
              }
            });
            const edges = (id) => document.getElementById(id).getBoundingClientRect();
            return [top, bottom, edges('views').bottom, edges('legend').top];""")
        self.assertGreater(top, above, "the arm begins below the buttons")
        self.assertLess(bottom, below, "and ends above the legend")

    def test_a_mesh_of_328_thousand_triangles_is_shown(self):
        """As many as a machine without a graphics card draws in time; tests/soak/view_speed.py has how fast."""
        bumpy_ball(self.folder / "ball.stl")
        scene = self.written("ball.yaml", "name: ball\nobjects:\n  - mesh: {name: ball, file: ball.stl, friction: 0.3}\n")
        with view_browser.Browser() as browser, Session(self.folder, "run", "--view", "--no-plot", "--scene", scene) as session:
            self.opened(browser, session)
            solid = "proxarm.world.objects.parts[0].getObjectByName('solid')"
            browser.until(f"{solid} !== undefined", "the mesh")
            triangles = browser.run(f"return {solid}.geometry.index.count / 3")
            self.assertTrue(20_000 < triangles <= 80_000, triangles)
            frames = browser.run("return proxarm.world.frames")
            browser.until(f"proxarm.world.frames > {frames} + 1", "a picture with it")
            self.assert_colour(browser.picture("mesh-light"), self.point_of(browser, 1.05, -0.15, 0.6),
                               lambda r, g, b: g > r + 8 and g > b + 2, "the ball's green")
            self.assertEqual(browser.complaints(), [])

    def test_all_shipped_scenes_are_drawn(self):
        scenes = sorted((SOURCE / "scenes").glob("*.yaml"))
        self.assertGreater(len(scenes), 10)
        scenes.append(self.written("regions.yaml", REGIONS))
        with view_browser.Browser() as browser:
            for scene in scenes:
                with self.subTest(scene.stem), Session(self.folder, "run", "--view", "--no-plot", "--pace", "virtual",
                                                       "--duration", "3s", "--scene", scene) as session:
                    session.until_said("until Ctrl-C")
                    self.opened(browser, session)
                    stage = browser.run("return proxarm.stage.scene")
                    browser.until("proxarm.world.frames > 1", "a picture")
                    for kind in ("mesh", "plane"):
                        of_kind = sum(o["shape"]["kind"] == kind for o in stage["objects"])
                        name = {"mesh": "solid", "plane": "sheet"}[kind]
                        browser.until(f"""{of_kind} <= (() => {{ let n = 0;
                            proxarm.world.objects.traverse((o) => {{ n += o.name === '{name}'; }}); return n; }})()""",
                                      f"each {kind}")
                    parts = browser.run("""let n = 0; proxarm.world.arm.traverse((o) => { n += o.name === 'tool'; });
                                           return [n, proxarm.stage.tool.parts.length]""")
                    self.assertEqual(parts[0], parts[1])
                    self.assertEqual(parts[0] > 0, "tool:" in scene.read_text())
                    regions = browser.run("return proxarm.world.objects.children.filter((o) => o.name === 'medium').length")
                    self.assertEqual(regions, sum(medium["within"] is not None for medium in stage["media"]))
                    notes = browser.run("return document.getElementById('notes').textContent")
                    everywhere = sum(medium["within"] is None for medium in stage["media"])
                    self.assertEqual(notes.count("everywhere: "), everywhere + (stage["coulomb_force"] is not None))
                    # What acted before the last cycle isn't told for good.
                    self.assertEqual(browser.run("return document.querySelectorAll('#held-back li').length"), 0)
                    self.assertEqual(browser.run("return document.getElementById('mode-chip').textContent"), "○ over")
                    # Nothing is drawn where nothing is: before rendering there is no proxy, and no way from it.
                    far = browser.run("""return Math.max(...proxarm.world.contacts.trail.points.map(([p]) =>
                                             p.distanceTo(proxarm.world.tool)))""")
                    self.assertLess(far, 0.5)
                    browser.run("proxarm.world.drawFine()")
                    browser.until("!proxarm.world.changed", "a fine picture")
                    browser.picture(f"scene-{scene.stem}")
                    rows, step = pixels(browser.small_picture(self.folder / "small.png", 0, 80, 980, 440))
                    colours = {bytes(row[at:at + 3]) for row in rows for at in range(0, len(row), step)}
                    self.assertGreater(len(colours), 200, "a picture that isn't blank")
                    self.assertEqual(browser.complaints(), [])

    def test_keys_do_what_the_mouse_does(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--pace", "virtual", "--duration", "2s") as session:
            session.until_said("until Ctrl-C")
            self.opened(browser, session)
            camera = "proxarm.world.camera.position.toArray()"
            distance = "proxarm.world.camera.position.distanceTo(proxarm.world.orbit.target)"
            before, far = browser.run(f"return [{camera}, {distance}]")
            browser.press("ArrowRight")
            turned = browser.run(f"return {camera}")
            self.assertGreater(sum(abs(a - b) for a, b in zip(before, turned)), 0.05)
            self.assertAlmostEqual(turned[2], before[2], places=9)
            self.assertAlmostEqual(browser.run(f"return {distance}"), far, places=9)
            browser.press("ArrowUp")
            self.assertGreater(browser.run(f"return {camera}")[2], before[2])
            browser.press("+")
            self.assertLess(browser.run(f"return {distance}"), far)
            target = browser.run("return proxarm.world.orbit.target.toArray()")
            browser.press("ArrowRight", modifiers=8)
            self.assertNotEqual(browser.run("return proxarm.world.orbit.target.toArray()"), target)
            browser.press("?")
            shown = browser.run("return document.getElementById('help').innerText")
            for words in ("orbit", "closer", "further away", "follow the tool"):
                self.assertIn(words, shown)
            self.assertNotIn("hold: ", shown, "without --view-control")
            self.assertEqual(browser.complaints(), [])

    def drawn_contacts(self, browser):
        """The cycle that is shown, and of each contact its place in the picture and the direction of its force."""
        return browser.run("""
            const { world } = proxarm, box = world.canvas.getBoundingClientRect();
            const marks = world.contacts.marks.filter(({ stick, slip }) => stick.visible || slip.visible);
            return [world.moment.cycle, world.moment.proxy_clearance_m, marks.map(({ stick, slip }) => {
              const arrow = stick.visible ? stick : slip, p = arrow.position.clone().project(world.camera);
              const along = arrow.position.clone().set(0, 0, 1).applyQuaternion(arrow.quaternion);
              return [box.left + (0.5 + p.x / 2) * box.width, box.top + (0.5 - p.y / 2) * box.height, ...along.toArray(),
                      arrow === slip];
            })];""")

    def assert_drawn_as_recorded(self, browser, drawn, folder):
        """Contacts within a pixel of where their places are, forces within 1°, the distance within 1 µm."""
        with open(folder / "signals.csv", newline="") as file:
            signals = {int(row["cycle"]): row for row in csv.DictReader(file)}
        contacts = {}
        with open(folder / "contacts.csv", newline="") as file:
            for row in csv.DictReader(file):
                force = [float(row[f"force_W_{axis}_N"]) for axis in "xyz"]
                if math.hypot(*force) * 0.0075 * 0.35 > 2e-3:  # shorter ones aren't drawn, however near the camera
                    contacts.setdefault(int(row["cycle"]), []).append((row, force))
        for cycle, distance, marks in drawn:
            self.assertAlmostEqual(distance, float(signals[cycle]["proxy_clearance_m"]), delta=1e-6)
            for row, force in contacts.get(cycle, []):
                place = self.point_of(browser, *(float(row[f"point_W_{axis}_m"]) for axis in "xyz"))
                x, y, *along, slips = min(marks, key=lambda mark: math.dist(mark[:2], place) +
                                          math.dist(mark[2:5], [part / math.hypot(*force) for part in force]))
                self.assertLess(math.dist((x, y), place), 1.0, f"cycle {cycle}")
                self.assertLess(math.dist(along, [part / math.hypot(*force) for part in force]), math.radians(1))
                self.assertEqual(slips, row["state"] == "slip")

    def test_contacts_are_drawn_where_the_tool_touches(self):
        """They were drawn at the handle: cones of the valve key floated 40 mm above it."""
        for scene, hand in (("rod_over_edge", "lean"), ("peg_in_hole", "insert"), ("valve_key", "wrench"),
                            ("box_on_table", "tip"), ("probe_on_molar", "probe")):
            arguments = ("run", "--no-plot", "--record", scene, "--duration", "6s", "--inertia", "0.05", "--scene",
                         SOURCE / f"scenes/{scene}.yaml", "--hand", SOURCE / f"sim/hands/{hand}.yaml")
            with self.subTest(scene), view_browser.Browser() as browser:
                with Session(self.folder, *arguments, "--view", "--pace", "realtime") as session:
                    self.opened(browser, session)
                    browser.until("proxarm.world.contacts.marks.some((m) => m.stick.visible || m.slip.visible)", "a touch")
                    live = []
                    for _ in range(20):
                        live.append(self.drawn_contacts(browser))
                        time.sleep(0.05)
                    session.until_said("until Ctrl-C")
                    self.assert_drawn_as_recorded(browser, live, self.folder / scene)
                with Session(self.folder, "view", scene) as session:
                    self.opened(browser, session)
                    browser.run("proxarm.world.look('tool'); proxarm.world.drawFine()")
                    with open(self.folder / scene / "contacts.csv", newline="") as file:
                        cycles = [int(row["cycle"]) for row in csv.DictReader(file)]
                    most = max(set(cycles), key=cycles.count)
                    for cycle in sorted({*cycles[:: len(cycles) // 8 + 1], most}):
                        browser.run(f"proxarm.player.goTo({cycle})")
                        browser.until(f"proxarm.player.isShown({cycle})", "that cycle")
                        drawn = self.drawn_contacts(browser)
                        self.assert_drawn_as_recorded(browser, [drawn], self.folder / scene)
                        if cycle == most:
                            browser.until("!proxarm.world.changed", "a fine picture")
                            browser.picture(f"contacts-{scene}")
                self.assertEqual(browser.complaints(), [])

    def test_a_button_with_the_focus_keeps_its_keys(self):
        """A record's keys took the space and the arrows of whoever walks through the page by Tab."""
        self.call("run", "--no-plot", "--record", "session", "--duration", "4s")
        with view_browser.Browser() as browser, Session(self.folder, "view", "session") as session:
            self.opened(browser, session)
            at = browser.run("return proxarm.player.at")
            browser.run("document.querySelector('[title^=\"a cycle on\"]').focus()")
            browser.press(" ", "Space", " ")
            self.assertEqual(browser.run("return [proxarm.player.at, proxarm.player.playing]"), [at + 1, False])
            browser.press("ArrowLeft")
            self.assertEqual(browser.run("return proxarm.player.at"), at + 1)
            # Who clicks goes on with the page's keys.
            box = browser.run("const b = document.querySelector('[title^=\"a cycle on\"]').getBoundingClientRect(); "
                              "return [b.left + 5, b.top + 5]")
            browser.click(*box)
            browser.until(f"proxarm.player.at === {at} + 2", "a click")
            browser.press("ArrowLeft")
            self.assertLess(browser.run("return proxarm.player.at"), at)
            browser.press(" ", "Space", " ")
            self.assertTrue(browser.run("return proxarm.player.playing"))

    def test_what_a_record_tells_is_of_its_cycle(self):
        """A limit was told for 0.7 s after a jump to where none acts, and in pictures of such a moment."""
        self.call("run", "--no-plot", "--record", "session", "--duration", "5s", "--fault", "axis_3:silent@4s")
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        with view_browser.Browser() as browser, Session(self.folder, "view", "session") as session:
            self.opened(browser, session)
            self.assert_everything_is_readable(browser)
            words = {flag["name"]: flag["words"] for flag in browser.run("return proxarm.stage.words.flags")}

            def told_at(index):
                browser.run(f"proxarm.player.goTo({index})")
                browser.until(f"proxarm.panel.moment.cycle === {rows[index]['cycle']} && !proxarm.panel.newFlags", "that cycle")
                return browser.run("return [...document.querySelectorAll('#held-back li')].map((item) => item.textContent)")

            last = [i for i in range(1, len(rows)) if rows[i]["flags"] != rows[i - 1]["flags"]]
            some = last[:: max(1, len(last) // 12)]
            told = {}
            for index in [i + back for i in some for back in (0, -1)]:
                told[index] = told_at(index)
                self.assertEqual(told[index], [text for name, text in words.items()
                                               if name in re.findall(r"\w+", rows[index]["flags"])], index)
                figure = browser.run("return document.querySelector('#figures dd').textContent")
                force = sum(float(rows[index][f"force_W_{axis}_N"]) ** 2 for axis in "xyz") ** 0.5
                self.assertAlmostEqual(float(figure.split()[0]), force, delta=0.006, msg="figures of the same cycle")
            self.assertTrue(any(told.values()) and not all(told.values()), "with limits and without")

    def phone(self, dark):
        theme = "dark" if dark else "light"
        with view_browser.Browser(390, 844, dark=dark) as browser, \
                Session(self.folder, "run", "--view-control", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            self.assertEqual(browser.run("return document.documentElement.dataset.theme"), theme)
            self.until_time(browser, 1.5)
            wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
            self.assertLessEqual(wide[0], wide[1], "nothing sticks out at the side")
            self.assert_everything_is_readable(browser)
            rows, step = pixels(browser.picture(f"phone-{theme}"))
            mean = sum(sum(row[0::step]) for row in rows) / sum(len(row) // step for row in rows)
            (self.assertLess if dark else self.assertGreater)(mean, 90 if dark else 180)
            browser.run("document.getElementById('plots').scrollIntoView({ block: 'end' })")
            time.sleep(0.3)
            browser.picture(f"phone-{theme}-below")
            self.assertEqual(browser.complaints(), [])

    def test_on_a_phone_in_the_light(self):
        self.phone(dark=False)

    def test_dark_and_on_a_phone(self):
        self.phone(dark=True)

    def test_the_other_theme_by_a_button(self):
        with view_browser.Browser(390, 844, dark=True) as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            self.assertEqual(browser.run("return document.documentElement.dataset.theme"), "dark")
            self.assertGreaterEqual(browser.run("return proxarm.world.canvas.getBoundingClientRect().height"), 300)
            browser.run("document.getElementById('theme').click()")
            browser.until("document.documentElement.dataset.theme === 'light'", "light")
            self.assertEqual(browser.complaints(), [])

    def test_sliders_change_the_session(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view-control", "--no-plot", "--record", "session", "--duration", "60s") as session:
            self.opened(browser, session)
            browser.until(f"{NOW}.phase === 3", "rendering")
            browser.run("""const field = document.getElementById('set-mass'), slider = field.parentElement.firstChild;
                           slider.value = 800; slider.dispatchEvent(new Event('input'));
                           slider.dispatchEvent(new Event('change'));""")
            answer = browser.until("document.getElementById('answer-mass').textContent", "an answer")
            self.assertTrue(answer.startswith("ok: mass="), answer)
            mass = float(browser.run("return document.getElementById('set-mass').value"))
            browser.until(f"Math.abs({NOW}.mass_kg - {mass}) < 1e-6", "the mass that was asked for")
            browser.run("""const field = document.getElementById('set-damping');
                           field.value = '-3'; field.dispatchEvent(new Event('change'));""")
            browser.until("document.getElementById('answer-damping').dataset.refused === 'true'", "a refusal")
            self.assertEqual(browser.run("return document.getElementById('set-damping').value"), "0")
            browser.run("document.querySelector('[data-line=hold]').click()")
            browser.until(f"{NOW}.phase === 4", "the hold")
            browser.picture("control-light")
            browser.run("document.querySelector('[data-line=resume]').click()")
            browser.until(f"{NOW}.phase === 3", "rendering again")
            self.assertEqual(browser.complaints(), [])
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertIn("holding", {row["phase"] for row in rows})
        masses = [float(row["proxy_mass_kg"]) for row in rows if row["phase"] == "rendering"]
        self.assertAlmostEqual(masses[-1] - masses[0], mass - 4.0, places=9)  # felt: with the handle's, before and after

    def type_into(self, browser, name, text):
        """As somebody does: by the keyboard, ended by Enter."""
        browser.run("const field = document.getElementById(arguments[0]); field.focus(); field.select()", f"set-{name}")
        browser.command("Input.insertText", dict(text=text))
        browser.press("Enter", text="\r")

    def assert_seen(self, browser, selector, what):
        """Nothing lies over the middle of this element, and all of it is within its panel and the window."""
        inside, found = browser.run("""
            const element = document.querySelector(arguments[0]), box = element.getBoundingClientRect();
            const panel = document.getElementById('panel').getBoundingClientRect();
            const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
            return [box.height > 0 && box.top >= panel.top - 1 && box.bottom <= panel.bottom + 1 && box.bottom <= innerHeight,
                    element.contains(top)];""", selector)
        self.assertTrue(inside and found, f"{what} is to be seen")

    def test_a_refusal_stands_beside_its_field(self):
        """It stood at the panel's end, below what is visible of it, and the field had gone back without a word."""
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view-control", "--no-plot", "--duration", "10min") as session:
            self.opened(browser, session)
            browser.until(f"{NOW}.phase === 3", "rendering")
            names = browser.run("return [...document.querySelectorAll('.parameter input[type=text]')].map((f) => f.id.slice(4))")
            self.assertIn("mass", names)
            self.assertGreater(len(names), 4, "with that of the scene")
            for name in names:
                with self.subTest(name):
                    before = browser.run("return document.getElementById(arguments[0]).value", f"set-{name}")
                    self.type_into(browser, name, "-7")
                    answer = f"document.getElementById('answer-{name}')"
                    said = browser.until(f"{answer}.dataset.refused === 'true' && {answer}.textContent", "a refusal")
                    self.assertTrue(said.startswith("refused: ") and "-7" in said, said)
                    self.assertEqual(browser.run("return document.getElementById(arguments[0]).value", f"set-{name}"), before)
                    self.assert_seen(browser, f"[id='answer-{name}']", "the reason")
                    self.assert_seen(browser, f"[id='set-{name}']", "the field beside it")
                    gap = browser.run("""const [a, b] = [...arguments].map((id) => document.getElementById(id).getBoundingClientRect());
                                         return b.top - a.bottom""", f"set-{name}", f"answer-{name}")
                    self.assertTrue(-1 <= gap <= 8, gap)
            self.type_into(browser, "mass", "-7")
            browser.until("document.getElementById('answer-mass').dataset.refused === 'true'", "a refusal")
            browser.picture("refusal-light")
            # An order's answer stands below the orders; out of a hold alone there is something to resume.
            browser.run("document.getElementById('panel').scrollTop = 1e6")
            browser.run("proxarm.control.ask('resume')")
            browser.until("document.getElementById('answer').dataset.refused === 'true'", "that nothing is held")
            self.assert_seen(browser, "#answer", "the reason")
            # What is typed next takes the reason away.
            self.assertTrue(browser.run("return document.getElementById('answer-mass').textContent"))
            browser.run("document.getElementById('set-mass').focus()")
            browser.command("Input.insertText", dict(text="5"))
            self.assertEqual(browser.run("return document.getElementById('answer-mass').textContent"), "")
            self.assertEqual(browser.complaints(), [])

    def test_orders_that_arent_possible_are_disabled_with_the_reason(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view-control", "--no-plot", "--duration", "10min") as session:
            self.opened(browser, session)

            def possible():
                return browser.run("""return [...document.querySelectorAll('#orders button')].filter((b) => !b.disabled)
                                             .map((b) => b.dataset.line)""")
            browser.until(f"{NOW}.phase === 3 && proxarm.control.phase === 'rendering'", "rendering")
            self.assertEqual(possible(), ["hold"])
            self.assertEqual(browser.run("return document.getElementById('not-now').textContent"),
                             "resume, release, back off 20 mm: the arm isn’t in a hold; reset: no stop by a fault waits for it")
            self.assertIn("the arm isn’t in a hold", browser.run("return document.querySelector('[data-line=resume]').title"))
            browser.run("document.querySelector('[data-line=hold]').click()")
            browser.until("proxarm.control.phase === 'holding'", "the hold")
            self.assertEqual(possible(), ["resume", "release", "back-off 20mm"])
            browser.run("document.querySelector('[data-line=resume]').click()")
            browser.until("proxarm.control.phase === 'rendering'", "rendering again")
            self.assertEqual(possible(), ["hold"])
            self.assertEqual(browser.complaints(), [])

    def test_the_microscope_shows_where_tool_and_steel_are(self):
        """24 µm and what the gears give are far below a pixel of the picture."""
        self.call("run", "--no-plot", "--record", "session", "--duration", "7s")
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        touching = [i for i, row in enumerate(rows) if row["contact"] != "free"]
        with view_browser.Browser() as browser, Session(self.folder, "view", "session") as session:
            self.opened(browser, session)
            for index in touching[200::len(touching) // 6]:
                browser.run(f"proxarm.player.goTo({index})")
                browser.until(f"proxarm.player.isShown({index}) && !proxarm.microscope.box.hidden", "that cycle")
                part = lambda name: [float(rows[index][f"{name}_W_{axis}_{'1' if name == 'normal' else 'm'}"]) for axis in "xyz"]
                proxy, normal = part("proxy"), part("normal")
                for thing, place in (("tool", part("tool")), ("steel", part("true_tool"))):
                    apart = [a - b for a, b in zip(place, proxy)]
                    up = sum(a * n for a, n in zip(apart, normal))
                    aside, told_up = browser.run(f"return proxarm.microscope.section.{thing}")
                    self.assertAlmostEqual(told_up, up, delta=1e-8, msg=thing)
                    if thing == "tool":
                        self.assertAlmostEqual(aside, math.hypot(*(a - up * n for a, n in zip(apart, normal))), delta=1e-8)
                bar = browser.run("return proxarm.microscope.bar_m")
                self.assertTrue(1e-6 <= bar <= 1e-2, bar)
            # How far from swinging it is there, as the session's judge had it.
            with open(self.folder / "session" / "summary.json") as file:
                places = json.load(file)["poses"]["places"]
            self.assertGreater(len(places), 4)
            now = browser.run("return proxarm.panel.moment.time_s")
            place = [place for place in places if place["time_s"] <= now][-1]
            self.assertIn(f"{place['smallest_stable_mass_kg']:.2g} kg ({4.0 / place['smallest_stable_mass_kg']:.2f} ×)",
                          browser.run("return document.getElementById('figures').innerText"))
            # An impact is told as the impulse that it is, not by its force in a cycle.
            begin = next(i for i in touching if rows[i - 1]["contact"] == "free")
            size = lambda row, name: math.hypot(*(float(row[f"{name}_W_{axis}_N"]) for axis in "xyz"))
            impulse = sum(max(0.0, size(rows[i], "contact_force") - size(rows[i], "force")) * 1e-3
                          for i in range(begin, begin + 51) if rows[i]["contact"] != "free")
            browser.run(f"proxarm.player.goTo({begin + 60})")
            browser.until(f"proxarm.player.isShown({begin + 60})", "just after it")
            self.assertAlmostEqual(browser.run("return proxarm.panel.moment.blow_Ns"), impulse, delta=0.01 * impulse)
            self.assertIn("Ns", browser.run("return document.getElementById('labels').innerText"))
            browser.run("proxarm.world.drawFine()")
            time.sleep(0.5)
            browser.picture("microscope-light")
            # Values under the pointer.
            box = browser.run("const b = document.querySelector('.plot').getBoundingClientRect(); return [b.left, b.top, b.width]")
            browser.command("Input.dispatchMouseEvent", dict(type="mouseMoved", x=box[0] + 0.7 * box[2], y=box[1] + 80))
            told = browser.until("!document.querySelector('.values').hidden && document.querySelector('.values').textContent",
                                 "values")
            self.assertRegex(told, r"^[\d.]+ s\npeaks [\d.]+\nhand [\d.]+\ncontact [\d.]+ N$")
            browser.press("m", text="m")
            browser.until("document.getElementById('microscope').hidden", "without it")
            self.assertEqual(browser.complaints(), [])

    def test_the_steel_is_shown_while_a_simulation_runs(self):
        """It was seen in records alone."""
        told = """const { section, box, touched, moment } = proxarm.microscope;
                  return !box.hidden && touched && section.steel ? [moment.cycle, section.steel[1], moment.tool_clearance_m] : null"""
        with view_browser.Browser() as browser:
            with Session(self.folder, "run", "--no-plot", "--record", "session", "--duration", "5s", "--view",
                         "--pace", "realtime") as session:
                self.opened(browser, session)
                browser.until(f"(() => {{ {told} }})()", "the touch")
                live = []
                for _ in range(15):
                    live.append(browser.run(told))
                    time.sleep(0.05)
                session.until_said("until Ctrl-C")
            self.assertEqual(browser.complaints(), [])
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = {int(row["cycle"]): row for row in csv.DictReader(file)}
        live = [one for one in live if one]
        self.assertGreater(len(live), 5)
        for cycle, up, clearance in live:
            row = rows[cycle]
            self.assertAlmostEqual(up, sum((float(row[f"true_tool_W_{axis}_m"]) - float(row[f"proxy_W_{axis}_m"])) *
                                           float(row[f"normal_W_{axis}_1"]) for axis in "xyz"), delta=1e-8)
            self.assertAlmostEqual(clearance, float(row["tool_clearance_m"]), delta=1e-6)
        self.assertLess(min(up for _, up, _ in live), -1e-6)

    def test_what_is_felt_stands_beside_what_is_meant(self):
        """A mass by force over acceleration, and a layer's spring by force over depth, both as the scene has them."""
        self.call("run", "--no-plot", "--record", "shaken", "--duration", "8s", "--scene", SOURCE / "scenes/free.yaml",
                  "--hand", SOURCE / "sim/hands/sweep.yaml")
        self.call("run", "--no-plot", "--record", "foam", "--duration", "8s", "--scene", SOURCE / "scenes/soft_wall.yaml")
        with view_browser.Browser() as browser:
            with Session(self.folder, "view", "shaken") as session:
                self.opened(browser, session)
                browser.run("proxarm.player.goTo(4000)")
                browser.until("proxarm.player.isShown(4000)", "that cycle")
                felt = browser.until("proxarm.felt.points?.length > 100 && proxarm.felt.felt_kg", "points")
                self.assertAlmostEqual(felt, 4.0, delta=0.2)
                self.assertIn("which no hand tells from what is meant", browser.run("return document.querySelector('#felt p').textContent"))
            with Session(self.folder, "view", "foam") as session:
                self.opened(browser, session)
                browser.run("proxarm.player.goTo(6000)")
                browser.until("proxarm.player.isShown(6000)", "that cycle")
                browser.until("proxarm.felt.touched?.length > 100", "points")
                slope, meant = browser.run("""
                    const pressed = proxarm.felt.touched.filter(([depth]) => depth > 2);
                    const layer = proxarm.stage.scene.objects.find((object) => object.layer).layer;
                    return [pressed.reduce((sum, [d, f]) => sum + f / d, 0) / pressed.length, layer.stiffness / 1e3];""")
                self.assertAlmostEqual(slope / meant, 1.0, delta=0.2)  # with friction, which is in the force as well
                browser.run("document.getElementById('felt').scrollIntoView({ block: 'end' })")
                time.sleep(0.5)
                browser.picture("felt-light")
            self.assertEqual(browser.complaints(), [])

    def heard(self, rows, band):
        """Amplitude in a third-octave band of a second of places, by the definition: the Fourier sum of each line of a
        window of Hann's over the places, their straight trend taken off; in µm."""
        count = len(rows)
        window = [0.5 - 0.5 * math.cos(2 * math.pi * i / count) for i in range(count)]
        power = 0.0
        for axis in "xyz":
            places = [float(row[f"true_tool_W_{axis}_m"]) for row in rows]
            middle, mean = (count - 1) / 2, sum(places) / count
            slope = sum((i - middle) * place for i, place in enumerate(places)) / sum((i - middle) ** 2 for i in range(count))
            rest = [w * (place - mean - slope * (i - middle)) for i, (w, place) in enumerate(zip(window, places))]
            for line in range(math.ceil(band / 10 ** 0.05), math.ceil(band * 10 ** 0.05)):
                turn = [2 * math.pi * line * i / count for i in range(count)]
                power += (sum(x * math.cos(a) for x, a in zip(rest, turn)) ** 2 +
                          sum(x * math.sin(a) for x, a in zip(rest, turn)) ** 2) * (2 / sum(window)) ** 2
        return 1e6 * math.sqrt(power / 1.5)

    def test_the_handles_spectrum_stands_beside_what_a_hand_notices(self):
        self.call("run", "--no-plot", "--record", "session", "--duration", "5s")
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        at = next(i for i, row in enumerate(rows) if row["contact"] != "free") + 600
        text = (SOURCE / "models/thresholds/hands.yaml").read_text()
        points = [[float(x) for x in pair] for pair in re.findall(r"frequency_Hz: ([\d.]+), amplitude_um: ([\d.]+)", text)]
        with view_browser.Browser() as browser, Session(self.folder, "view", "session") as session:
            self.opened(browser, session)
            told = browser.run("return proxarm.spectrum.points")
            self.assertEqual(len(told), len(points))
            for (f, um), (f_told, um_told) in zip(points, told):
                self.assertAlmostEqual(f, f_told)
                self.assertAlmostEqual(um, um_told, places=9)
            browser.run(f"proxarm.player.goTo({at})")
            browser.until(f"proxarm.player.isShown({at}) && proxarm.player.heard === {at} && proxarm.spectrum.at === {at}",
                          "what is heard there")
            bands = browser.run("return proxarm.spectrum.bands")
            self.assertEqual([round(band["centre_Hz"]) for band in bands],
                             [10, 13, 16, 20, 25, 32, 40, 50, 63, 79, 100, 126, 158, 200, 251, 316, 398])
            second = rows[at - 1000:at]
            self.assertTrue(all(row["phase"] == "rendering" for row in second))
            for band in bands[3:12:2]:  # lower ones have the hand's own motion, which a trend doesn't take off
                self.assertAlmostEqual(self.heard(second, band["centre_Hz"]) / band["amplitude_um"], 1.0, delta=0.1,
                                       msg=band["centre_Hz"])
            loudest = max(bands, key=lambda band: band["amplitude_um"] / band["threshold_um"])
            ratio = loudest["amplitude_um"] / loudest["threshold_um"]
            words = browser.run("return document.querySelector('#vibration p').textContent")
            self.assertTrue(words.startswith("a hand notices " if ratio >= 1 else "no hand notices "), words)
            self.assertIn(f" at {loudest['frequency_Hz']:.0f} Hz, of the steel", words)
            self.assertIn("Brisben", browser.run("return document.getElementById('vibration').title"))
            browser.run("document.getElementById('vibration').scrollIntoView({ block: 'end' })")
            time.sleep(0.3)
            browser.picture("vibration-light")
            # Of the first second nothing is told.
            first = next(i for i, row in enumerate(rows) if row["phase"] == "rendering")
            browser.run(f"proxarm.player.goTo({first + 500})")
            browser.until(f"proxarm.spectrum.at === {first + 500}", "the beginning")
            self.assertEqual(browser.run("return proxarm.spectrum.bands"), [])
            self.assertEqual(browser.run("return document.querySelector('#vibration p').textContent"),
                             "after a second of rendering without a break")
            self.assertEqual(browser.complaints(), [])
        with view_browser.Browser(dark=True) as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            browser.until("proxarm.spectrum.bands.length === 17 && proxarm.spectrum.of === 'steel'", "the spectrum, live")
            browser.run("document.getElementById('vibration').scrollIntoView({ block: 'end' })")
            time.sleep(0.3)
            browser.picture("vibration-dark")
            self.assertEqual(browser.complaints(), [])

    def assert_dots_are_of_the_judge(self, browser, places):
        """Each dot of the way has the class of the place that was judged last."""
        counts, way, shown = browser.run("""
            const { margins } = proxarm.world;
            return [margins.counts, margins.way.map(({ time_s }) => time_s), margins.dots.map((dots) => dots.visible)];""")
        wanted = [0, 0, 0, 0]
        for time_s in way:
            judged = [place for place in places if place["time_s"] <= time_s + 1e-9]
            if not judged:
                continue
            smallest = judged[-1]["smallest_stable_mass_kg"]
            ratio = judged[-1]["felt_mass_kg"] / smallest if smallest else 0
            wanted[0 if ratio < 1 else 1 if ratio < 1.5 else 2 if ratio < 3 else 3] += 1
        self.assertEqual(counts, wanted)
        self.assertGreater(sum(counts), 50)
        self.assertEqual(shown, [count > 0 for count in counts])

    def test_how_far_from_swinging_is_colour_along_the_way(self):
        arguments = ("run", "--no-plot", "--record", "session", "--duration", "6s", "--mass", "3kg")
        with view_browser.Browser() as browser:
            with Session(self.folder, *arguments, "--view", "--pace", "realtime") as session:
                self.opened(browser, session)
                browser.until("proxarm.world.margins?.counts?.some(Boolean)", "colour, live")
                legend = browser.run("return document.getElementById('margin-legend').innerText")
                for words in ("mass over the smallest stable", "may swing", "1 to 1.5", "1.5 to 3", "over 3"):
                    self.assertIn(words, legend)
                session.until_said("until Ctrl-C")
            self.assertEqual(browser.complaints(), [])
        with open(self.folder / "session" / "summary.json") as file:
            places = json.load(file)["poses"]["places"]
        for dark in (False, True):
            with view_browser.Browser(dark=dark) as browser, Session(self.folder, "view", "session") as session:
                self.opened(browser, session)
                browser.until("proxarm.world.margins.counts?.some(Boolean)", "the way")
                self.assert_dots_are_of_the_judge(browser, places)
                legend, dots = browser.run("""
                    const paint = (i) => proxarm.world.margins.dots[i].material.color.getHexString();
                    return [[...document.querySelectorAll('#margin-legend i')].map((dot) => getComputedStyle(dot).backgroundColor),
                            [0, 1, 2, 3].map(paint)];""")
                self.assertEqual([[int(part) for part in re.findall(r"\d+", words)] for words in legend],
                                 [[int(paint[i:i + 2], 16) for i in (0, 2, 4)] for paint in dots])
                browser.run("proxarm.world.look('tool'); proxarm.world.drawFine()")
                browser.until("!proxarm.world.changed", "a fine picture")
                browser.picture("margins-dark" if dark else "margins-light")
                self.assertEqual(browser.complaints(), [])

    def test_the_microscope_shows_both_sides_of_a_fit(self):
        """A peg of 20 mm g6 in a bore of 20 mm H7 has 24 µm; both sides were never seen at once."""
        arguments = ("run", "--no-plot", "--record", "peg", "--duration", "5s", "--inertia", "0.05", "--scene",
                     SOURCE / "scenes/peg_in_hole.yaml", "--hand", SOURCE / "sim/hands/insert.yaml")
        told = """const { section, box, touched } = proxarm.microscope, { cycle } = proxarm.microscope.moment ?? {};
                  return box.hidden ? null : [cycle, section.other, section.proxy[1], section.tool, section.steel ?? null, touched]"""
        with view_browser.Browser() as browser:
            with Session(self.folder, *arguments, "--view", "--pace", "realtime") as session:
                self.opened(browser, session)
                browser.until(f"(() => {{ {told} }})()", "the fit, live")
                live = []
                for _ in range(30):
                    live.append(browser.run(told))
                    time.sleep(0.05)
                browser.picture("fit-live")
                session.until_said("until Ctrl-C")
            self.assertTrue(all(live), "the peg is in its bore all the time")
            # Before it is pressed askew it is as far from one side as the other lets it: 24 µm in all.
            self.assertTrue(any(abs(one[1] - 24e-6) < 1e-6 for one in live), live)
            self.assertTrue(all(-1e-7 <= one[1] < 25e-6 for one in live), live)
            self.assertTrue(all(one[4] for one in live), "the steel, which a simulation tells while it runs")
            with open(self.folder / "peg" / "signals.csv", newline="") as file:
                rows = {int(row["cycle"]): row for row in csv.DictReader(file)}
            for cycle, _, proxy, tool, steel, touched in live:
                if touched:
                    continue
                part = lambda name: [float(rows[cycle][f"{name}_W_{axis}_m"]) for axis in "xyz"]
                self.assertAlmostEqual(math.hypot(*tool), math.dist(part("tool"), part("proxy")), delta=1e-9)
                self.assertLess(math.hypot(*steel), math.dist(part("true_tool"), part("proxy")) + 1e-9)
                self.assertGreaterEqual(proxy, 0)
            for size, dark in (((1280, 720), False), ((390, 844), True)):
                with self.subTest(size), Session(self.folder, "view", "peg") as session, \
                        view_browser.Browser(*size, dark=dark) as other:
                    self.opened(other, session)
                    fits = {}
                    for index in range(1000, len(rows), 150):
                        other.run(f"proxarm.player.goTo({index})")
                        other.until(f"proxarm.microscope.moment?.cycle === {list(rows)[index]}", "that cycle")
                        fits[index] = other.run(told)[1]
                    self.assertLess(max(fits.values()), 24.1e-6)
                    self.assertLess(min(fits.values()), 5e-6, "held askew it has less room")
                    straight = max(fits, key=fits.get)
                    other.run(f"proxarm.player.goTo({straight})")
                    other.until(f"proxarm.player.isShown({straight})", "that cycle")
                    self.assertAlmostEqual(other.run("return proxarm.microscope.section.other"), 24e-6, delta=1e-6)
                    # It is wide enough to be seen.
                    self.assertTrue(10e-6 <= other.run("return proxarm.microscope.bar_m") <= 100e-6)
                    other.picture(f"fit-{size[0]}")
                    self.assertEqual(other.complaints(), [])
            self.assertEqual(browser.complaints(), [])

    def test_a_cycle_of_force_over_depth_has_its_energy(self):
        """F = k x + c ẋ with x = a + A sin ωt takes π c ω A² of each cycle, whatever k is."""
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--pace", "virtual", "--duration", "1s") as session:
            session.until_said("until Ctrl-C")
            self.opened(browser, session)

            def energy(damping, turns=3.3, amplitude=0.5):
                points = []
                for i in range(300):
                    angle = 2 * math.pi * turns * i / 299 - 1.2
                    x, v = 1 + amplitude * math.sin(angle), amplitude * 2 * math.pi * 2 * math.cos(angle)  # mm, mm/s: 2 Hz
                    points.append([x, 3.0 * x + damping * v])
                return browser.run("""return import('./felt.js').then(({ cycleOf }) => cycleOf(arguments[0])?.energy_mJ ?? null)
                                   """.replace("arguments[0]", json.dumps(points)))

            for damping in (0.05, -0.05, 0.4):
                self.assertAlmostEqual(energy(damping), math.pi * damping * 2 * math.pi * 2 * 0.25,
                                       delta=0.01 * math.pi * 4 * math.pi * 0.25 * abs(damping))
            self.assertAlmostEqual(energy(0.0), 0.0, places=9)
            self.assertIsNone(energy(0.05, turns=0.8), "no whole cycle")
            self.assertIsNone(energy(0.05, amplitude=2e-4), "noise")
            self.assertEqual(browser.complaints(), [])

    def test_a_unit_may_be_typed(self):
        """"4kg" became "4kgkg"."""
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view-control", "--no-plot", "--duration", "10min") as session:
            self.opened(browser, session)
            browser.until(f"{NOW}.phase === 3", "rendering")
            for name, typed, shown in (("mass", "5kg", "5"), ("mass", "4500 g", "4.5"), ("mass", "6", "6"),
                                       ("damping", " 3 Ns/m", "3"), ("damping", "1e0", "1"), ("spring", "5N/m", "5")):
                with self.subTest(name=name, typed=typed):
                    self.type_into(browser, name, typed)
                    answer = f"document.getElementById('answer-{name}')"
                    browser.until(f"{answer}.dataset.refused === 'false' && {answer}.textContent.startsWith('ok: {name}=')",
                                  "that it is taken")
                    browser.until(f"document.getElementById('set-{name}').value === '{shown}'", "the value alone")
                    browser.until(f"{answer}.textContent === ''", "an answer that is taken away")
            for name, typed in (("mass", "4N"), ("mass", "4kgkg"), ("mass", "1 2"), ("damping", "3 kg"), ("mass", "")):
                with self.subTest(name=name, typed=typed):
                    before = browser.run(f"return document.getElementById('set-{name}').value")
                    self.type_into(browser, name, typed or " ")
                    answer = f"document.getElementById('answer-{name}')"
                    said = browser.until(f"{answer}.textContent", "a refusal")
                    self.assertTrue(said.startswith("refused: "), said)
                    self.assertNotIn("kgkgkg", said)
                    self.assertEqual(browser.run(f"return document.getElementById('set-{name}').value"), before)
            self.assertEqual(browser.complaints(), [])

    def test_after_the_end_nothing_can_be_changed(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view-control", "--no-plot", "--pace", "virtual", "--duration", "1s") as session:
            session.until_said("until Ctrl-C")
            self.opened(browser, session)
            browser.until("!document.getElementById('ended').hidden", "the end")
            enabled = browser.run("return [...document.querySelectorAll('#control button, #control input')].filter((i) => !i.disabled).length")
            self.assertEqual(enabled, 0)
            self.assertIn("The session is over", browser.run("return document.getElementById('control').innerText"))
            browser.press("h", text="h")
            browser.until("document.getElementById('answer').textContent === 'refused: the session is over'", "the key, too")
            browser.run("document.getElementById('control').scrollIntoView({ block: 'start' })")
            browser.picture("control-over-light")

    def test_what_a_picture_tells_is_one_number(self):
        """The panel had 12.4 N and the label in the picture 13.9 N."""
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            self.until_time(browser, 3.8)
            told = browser.run("""
                const figure = (name) => [...document.querySelectorAll('#figures dt')].find((t) => t.textContent === name)
                  .nextSibling.textContent;
                const pairs = [], until = performance.now() + 10_000;
                return new Promise((done) => {
                  const look = () => {
                    const labels = [...document.querySelectorAll('#labels span')].filter((l) => !l.hidden).map((l) => l.textContent);
                    if (labels.length === 2) pairs.push([...labels.sort(), '|', ...[figure('force of contact'), figure('hand’s force')].sort()]);
                    if (pairs.length < 60 && performance.now() < until) requestAnimationFrame(look); else done(pairs);
                  };
                  requestAnimationFrame(look);
                });""")
            for pair in told:
                labels, figures = pair[:2], pair[3:]
                self.assertEqual([text.removesuffix(", arrow cut") for text in labels], figures)
            self.assertGreater(len({pair[0] for pair in told}), 3, "numbers that change")

    def test_no_overrun_stands_beside_a_cycle_longer_than_its_period(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--pace", "virtual", "--duration", "1s") as session:
            session.until_said("until Ctrl-C")
            self.opened(browser, session)

            def note(compute_us, overruns):
                browser.run("""proxarm.plots.rows = [[0.1, 20], [0.2, arguments[0]], [0.3, 20]].map(([time_s, us]) => ({
                                 ...proxarm.panel.moment, time_s, compute_us: 20, compute_peak_us: us, period_s: 1e-3,
                                 overruns: arguments[1] }));
                               proxarm.plots.stale = true;""", compute_us, overruns)
                browser.until("!proxarm.plots.stale", "that it is drawn")
                return browser.run("return proxarm.plots.plots[3].head[proxarm.plots.plots[3].head.length - 1].text")

            self.assertEqual(note(900, 0), "no overrun")
            self.assertEqual(note(84123, 0), "over the period: 84.1 ms")
            self.assertEqual(note(84123, 2), "2 overruns")
            self.assertEqual(note(84123, 1), "1 overrun")
            self.assertEqual(browser.complaints(), [])

    def test_an_impact_is_cut_and_told(self):
        """The arrow of a blow of 136 N left the picture, and so did its peak in the plot, both without their number."""
        self.call("run", "--no-plot", "--record", "session", "--duration", "5s")
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            forces = [sum(float(row[f"contact_force_W_{axis}_N"]) ** 2 for axis in "xyz") ** 0.5 for row in csv.DictReader(file)]
        impact = max(range(len(forces)), key=forces.__getitem__)
        self.assertGreater(forces[impact], 60)
        for size in ((1280, 720), (390, 844)):
            with self.subTest(size), view_browser.Browser(*size) as browser, Session(self.folder, "view", "session") as session:
                self.opened(browser, session)
                # Opened where the contact lasts, not at the blow.
                opened = browser.run("return proxarm.stage.record.open_at")
                self.assertTrue(all(force > 0 for force in forces[opened - 100:opened + 1]))
                self.assertLess(forces[opened], 20)
                browser.run(f"proxarm.player.goTo({impact})")
                browser.until(f"proxarm.player.isShown({impact})", "the blow")
                label = browser.until("""[...document.querySelectorAll('#labels span')].filter((l) => !l.hidden)
                                         .map((l) => l.textContent).find((text) => text.includes('cut'))""", "its label")
                self.assertEqual(label, f"{forces[impact]:.2f} N, arrow cut")
                ends = browser.run("""
                    const { stick, slip } = proxarm.world.contacts.marks[0], arrow = stick.visible ? stick : slip;
                    const end = arrow.head.getWorldPosition(proxarm.world.middle.clone()).project(proxarm.world.camera);
                    const box = [...document.querySelectorAll('#labels span')].find((l) => l.textContent.includes('cut'))
                      .getBoundingClientRect(), picture = proxarm.world.canvas.getBoundingClientRect();
                    return [end.x, end.y, arrow.second.visible, box.left >= picture.left && box.right <= picture.right];""")
                self.assertTrue(abs(ends[0]) < 1 and abs(ends[1]) < 1, ends)
                self.assertEqual(ends[2:], [True, True])
                peaks = browser.until("proxarm.plots.plots[0].peaks?.length && proxarm.plots.plots[0].peaks.map((p) => p.text)",
                                      "the peak's number")
                self.assertIn(f"{forces[impact]:.3g}", " ".join(peaks))
                browser.picture(f"impact-{size[0]}")
                # A force that has room has its whole arrow.
                browser.run(f"proxarm.player.goTo({opened})")
                browser.until(f"proxarm.player.isShown({opened})", "the opening")
                self.assertNotIn("cut", browser.run("return document.getElementById('labels').innerText"))
                self.assertEqual(browser.complaints(), [])

    def test_a_tool_that_turns_has_torques(self):
        """And a point that is held has none."""
        self.call("run", "--no-plot", "--record", "session", "--duration", "3s", "--scene", SOURCE / "scenes/peg_in_hole.yaml",
                  "--inertia", "0.05kgm2")
        with open(self.folder / "session" / "signals.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        norm = lambda row, name: sum(float(row[f"{name}_W_{axis}_Nm"]) ** 2 for axis in "xyz") ** 0.5
        index = max(range(len(rows)), key=lambda i: norm(rows[i], "contact_torque"))
        row = rows[index]
        self.assertGreater(norm(row, "contact_torque"), 0.001)
        figures = """return Object.fromEntries([...document.querySelectorAll('#figures dt')].filter((t) => !t.hidden)
                     .map((t) => [t.textContent, t.nextSibling.textContent]))"""
        with view_browser.Browser() as browser, Session(self.folder, "view", "session") as session:
            self.opened(browser, session)
            browser.run(f"proxarm.player.goTo({index})")
            browser.until(f"proxarm.player.isShown({index})", "that cycle")
            told = browser.run(figures)
            self.assertEqual(told["torque of contact"], f"{norm(row, 'contact_torque'):.3f} Nm")
            self.assertEqual(told["hand’s torque"], f"{norm(row, 'torque'):.3f} Nm")
            self.assertAlmostEqual(float(told["inertia felt"].split()[0]), float(row["proxy_inertia_kg_m2"]),
                                   delta=0.006 * float(row["proxy_inertia_kg_m2"]))
            browser.picture("torques-light")
            self.assertEqual(browser.complaints(), [])
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--pace", "virtual", "--duration", "1s") as session:
            session.until_said("until Ctrl-C")
            self.opened(browser, session)
            browser.until("document.querySelectorAll('#figures dd')[0].textContent", "figures")
            self.assertFalse([name for name in browser.run(figures) if "torque" in name or "inertia" in name])

    def test_fields_follow_whoever_changes_something(self):
        with view_browser.Browser() as browser, \
                Session(self.folder, "run", "--view-control", "--control", "ear", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            browser.until(f"{NOW}.phase === 3", "rendering")
            field = "document.getElementById('set-damping')"
            self.assertEqual(self.call("set", "--control", "ear", "damping=8Ns/m").status, 0)
            browser.until(f"{field}.value === '8'", "what a terminal has set")
            browser.run("location.reload()")
            browser.until(FIRST_MOMENT, "the page anew")
            self.assertEqual(browser.run(f"return {field}.value"), "8")
            # Somebody writes there while another one sets it: what is written stays, and goes its way.
            browser.run(f"{field}.focus(); {field}.value = '0'; {field}.dispatchEvent(new Event('input'))")
            self.assertEqual(self.call("set", "--control", "ear", "damping=4Ns/m").status, 0)
            browser.until(f"{NOW}.damping_Ns_per_m >= 4 && {NOW}.damping_Ns_per_m < 8", "what was set meanwhile")
            self.assertEqual(browser.run(f"return {field}.value"), "0")
            browser.run(f"{field}.dispatchEvent(new Event('change'))")
            browser.until("document.getElementById('answer-damping').textContent === 'ok: damping=0Ns/m'",
                          "back to the first value")
            browser.until(f"{field}.value === '0' && {NOW}.damping_Ns_per_m < 4", "the damping that was written")
            self.assertEqual(browser.complaints(), [])

    def test_a_record_opens_at_the_fault_and_plays(self):
        self.call("run", "--no-plot", "--record", "session", "--duration", "5s", "--fault", "axis_3:silent@4s")
        with view_browser.Browser() as browser, Session(self.folder, "view", "session") as session:
            self.opened(browser, session)
            shown = browser.until("document.getElementById('fault').textContent", "the fault")
            self.assertIn("drive_silent", shown)
            at = browser.run("return proxarm.player.at")
            browser.until("document.querySelectorAll('#frame-table tr').length > 10", "frames of the bus")
            browser.picture("fault-light")
            browser.run("proxarm.player.step(-1)")
            browser.until(f"proxarm.player.asked === {at - 1}", "a cycle back")
            browser.run("proxarm.player.jump(0, 'contact')")
            browser.until("document.getElementById('contact-chip').dataset.contact !== 'free'", "the contact")
            self.assertTrue(browser.run("return document.getElementById('fault').hidden"))
            box = browser.run("const b = proxarm.player.canvas.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]")
            browser.click(box[0] + box[2] / 2, box[1] + box[3] / 2)
            cycles = browser.run("return proxarm.stage.record.cycles")
            browser.until(f"Math.abs(proxarm.player.at - {cycles} / 2) < {cycles} / 50", "the place that was clicked")
            browser.run("proxarm.player.speed.value = 2; proxarm.player.toggle()")
            before = browser.run("return proxarm.player.asked")
            browser.until(f"proxarm.player.asked > {before} + 100", "that it plays")
            self.assertEqual(browser.complaints(), [])


if __name__ == "__main__":
    unittest.main()

"""The page of the view in a real browser: what stands in its scene graph, and what is to be seen in its pixels."""
import csv
import os
import struct
import time
import unittest
import zlib

import view_browser
from harness import ProgramTest
from timing_test import bumpy_ball
from view_client import Session

FIRST_MOMENT = 'window.proxarm && performance.getEntriesByName("first-moment").length > 0'
NOW = "proxarm.plots.rows[proxarm.plots.rows.length - 1]"


def pixels(path):
    """A PNG of 8-bit RGB(A) as rows of bytes and its bytes per pixel; by the standard library alone."""
    data = path.read_bytes()
    at, packed, width, colours = 8, b"", 0, 0
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IHDR":
            width, _, _, colours = struct.unpack_from(">IIBB", data, at + 8)
        elif kind == b"IDAT":
            packed += data[at + 8:at + 8 + length]
        at += 12 + length
    step = {2: 3, 6: 4}[colours]
    raw, rows, before = zlib.decompress(packed), [], bytearray(width * step)
    for start in range(0, len(raw), width * step + 1):
        method, row = raw[start], bytearray(raw[start + 1:start + 1 + width * step])
        for i in range(len(row)):
            left, up = (row[i - step] if i >= step else 0), before[i]
            corner = before[i - step] if i >= step else 0
            if method == 1:
                row[i] = (row[i] + left) & 255
            elif method == 2:
                row[i] = (row[i] + up) & 255
            elif method == 3:
                row[i] = (row[i] + (left + up) // 2) & 255
            elif method == 4:
                guess = left + up - corner
                near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))
                row[i] = (row[i] + near[2]) & 255
        rows.append(row)
        before = row
    return rows, step


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
            self.assertEqual(browser.run("return document.getElementById('control').hidden"), True)
            self.assertEqual(browser.run("return document.getElementById('phase-chip').textContent"), "rendering")
            self.assertEqual(browser.complaints(), [])

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

    def test_dark_and_on_a_phone(self):
        with view_browser.Browser(390, 844, dark=True) as browser, \
                Session(self.folder, "run", "--view", "--no-plot", "--duration", "60s") as session:
            self.opened(browser, session)
            self.assertEqual(browser.run("return document.documentElement.dataset.theme"), "dark")
            self.until_time(browser, 1.5)
            wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
            self.assertLessEqual(wide[0], wide[1], "nothing sticks out at the side")
            self.assertGreaterEqual(browser.run("return proxarm.world.canvas.getBoundingClientRect().height"), 300)
            rows, step = pixels(browser.picture("phone-dark"))
            mean = sum(sum(row[0::step]) for row in rows) / sum(len(row) // step for row in rows)
            self.assertLess(mean, 90)
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
            answer = browser.until("document.getElementById('answer').textContent", "an answer")
            self.assertTrue(answer.startswith("ok: mass="), answer)
            mass = float(browser.run("return document.getElementById('set-mass').value"))
            browser.until(f"Math.abs({NOW}.mass_kg - {mass}) < 1e-6", "the mass that was asked for")
            browser.run("""const field = document.getElementById('set-damping');
                           field.value = '-3'; field.dispatchEvent(new Event('change'));""")
            browser.until("document.getElementById('answer').dataset.refused === 'true'", "a refusal")
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
            browser.until("document.getElementById('answer').textContent === 'ok: damping=0Ns/m'", "back to the first value")
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

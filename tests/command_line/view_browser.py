"""A headless Chromium for the tests of the page, driven by Debian's chromium-driver through python3-selenium."""
import base64
import os
import pathlib
import struct
import tempfile
import time
import zlib

from harness import SOURCE

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
except ImportError:
    webdriver = None

CHROMIUM, DRIVER = pathlib.Path("/usr/bin/chromium"), pathlib.Path("/usr/bin/chromedriver")
PATIENCE_S = 40
# Where the pictures of a test run are kept for people to look at.
PICTURES = pathlib.Path(os.environ.get("PROXARM_PICTURES") or SOURCE / "build" / "pictures")


def why_not():
    """The reason why there is no browser here, or None."""
    if webdriver is None:
        return "no python3-selenium"
    missing = [str(path) for path in (CHROMIUM, DRIVER) if not path.exists()]
    return f"no {' and no '.join(missing)} (Debian packages chromium, chromium-driver)" if missing else None


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


class Browser:
    def __init__(self, width=1280, height=720, dark=False):
        options = Options()
        options.binary_location = str(CHROMIUM)
        self.profile = tempfile.TemporaryDirectory(prefix="proxarm-chromium-")
        # Drawn by software, as on a machine without a GPU; nothing of the browser's own goes to the network.
        for word in ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader-webgl",
                     "--enable-unsafe-swiftshader",
                     "--ignore-gpu-blocklist", "--disable-quic", "--no-first-run", "--disable-background-networking",
                     "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--disable-dev-shm-usage",
                     "--force-device-scale-factor=1", f"--user-data-dir={self.profile.name}"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service(str(DRIVER)), options=options)
        self.command("Emulation.setDeviceMetricsOverride",
                     dict(width=width, height=height, deviceScaleFactor=1, mobile=width < 600))
        self.command("Emulation.setEmulatedMedia",
                     dict(features=[dict(name="prefers-color-scheme", value="dark" if dark else "light")]))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.driver.quit()
        self.profile.cleanup()

    def command(self, name, values):
        return self.driver.execute_cdp_cmd(name, values)

    def open(self, url):
        self.driver.get(url)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def until(self, condition, what, patience_s=PATIENCE_S):
        """Waits for a condition in JavaScript; returns its value."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            value = self.run(f"return {condition}")
            if value:
                return value
            time.sleep(0.02)
        raise AssertionError(f"not within {patience_s} s: {what}; console: {self.complaints()}")

    def click(self, x, y):
        for kind in ("mousePressed", "mouseReleased"):
            self.command("Input.dispatchMouseEvent", dict(type=kind, x=x, y=y, button="left", buttons=1, clickCount=1))

    def press(self, key, code=None, text=None, modifiers=0):
        """A key, as DevTools names it; what it types where it types something."""
        more = dict(text=text) if text else {}
        for kind in ("keyDown", "keyUp"):
            self.command("Input.dispatchKeyEvent", dict(type=kind, key=key, code=code or key, modifiers=modifiers, **more))

    def complaints(self):
        """What the console has of errors and warnings, but for those that the browser gives for being slow itself."""
        return [entry["message"] for entry in self.driver.get_log("browser")
                if entry["level"] in ("SEVERE", "WARNING") and "GPU stall" not in entry["message"]
                and "GroupMarkerNotSet" not in entry["message"] and "Automatic fallback" not in entry["message"]]

    def small_picture(self, path, left, top, width, height):
        """A part of the page at a quarter of its size."""
        clip = dict(x=left, y=top, width=width, height=height, scale=0.25)
        path.write_bytes(base64.b64decode(self.command("Page.captureScreenshot", dict(format="png", clip=clip))["data"]))
        return path

    def picture(self, name):
        PICTURES.mkdir(parents=True, exist_ok=True)
        path = PICTURES / f"{name}.png"
        self.driver.get_screenshot_as_file(str(path))
        return path

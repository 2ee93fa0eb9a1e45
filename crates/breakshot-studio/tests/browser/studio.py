"""A person's way through the studio in headless Chromium.

usage: studio.py BREAKSHOT DEMO SHOTS [--no-bounds]

BREAKSHOT is the program, DEMO the folder of the demo's films, SHOTS the folder for the pictures of every view. Every step asserts what a
person would see; the last lines are the measured latencies. They have bounds, unless the program is not a release build (--no-bounds); then
also only some frames of each film are compared with those on the screen.
"""

import hashlib
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib

from playwright.sync_api import TimeoutError as PlaywrightTimeout
from playwright.sync_api import expect, sync_playwright

CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
# A fit of the camera that takes longer has failed (ms); it is no bound of a latency.
FIT_MS = 20_000
# After this time (ms) the browser has drawn no picture, and it is asked again.
PICTURE_MS = 10_000
# Bounds of the latencies (ms), p95.
MOTION_MS, CLOUD_MS, STEP_MS = 33, 150, 50
# Every so many frames of a film are compared where the program is not a release build.
SOME = 12
# Bound of the first paint after the page is asked for (ms).
PAINT_MS = 1000

KEYS_OF_VIEWS = {"films": "Alt+1", "learned": "Alt+2", "pile": "Alt+3", "compare": "Alt+4", "cell": "Alt+5", "robot": "Alt+6"}

# An arm that reaches the demo's table.
ROBOT = """
[robot]
arm = "indy7"
base_from_table = { position_m = [0.55, 0.0, 0.0], rpy_rad = [0.0, 0.0, -1.5708] }
tool_offset_m = [0.0, 0.0, 0.12]
tool_mass_kg = 0.3
"""

FOUR = """cell = "cell.toml"
objects = "objects.toml"

# Four objects that touch.
[[placed]]
object = "a"
position_m = [-0.06, 0.0]

[[placed]]
object = "c"
position_m = [0.0151, 0.0]

[[placed]]
object = "e"
position_m = [-0.02, 0.0585]

[[placed]]
object = "e#2"
position_m = [-0.02, -0.0585]
"""


def percentile(values, part):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, round(part * (len(ordered) - 1)))]


class Studio:
    """The program, and a page of it."""

    def __init__(self, program, folder, browser):
        self.program, self.folder = program, folder
        arguments = [program, "studio", str(folder), "--no-open"]
        self.process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
        self.process.stdout.readline()
        self.link = self.process.stdout.readline().strip()
        self.context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
        self.page = self.context.new_page()
        self.problems = []
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", lambda m: m.type == "error" and self.problems.append(m.text))
        self.page.add_init_script("performance.setResourceTimingBufferSize(20000)")

    def close(self):
        self.context.close()
        self.process.kill()
        self.process.wait()

    def command(self, *arguments):
        return subprocess.run([self.program, *arguments], cwd=self.folder, check=False, capture_output=True, text=True)

    def go(self, view):
        self.page.keyboard.press(KEYS_OF_VIEWS[view])
        expect(self.page.locator(f"#{view}")).to_be_visible()

    def picture(self, path):
        """A picture of the page, for people; nothing is asserted of it. Headless Chromium without a GPU sometimes draws none, and then the file is missing."""
        for _ in range(2):
            try:
                self.page.screenshot(path=str(path), timeout=PICTURE_MS)
                return
            except PlaywrightTimeout:
                pass
        print(f"no picture {path}: the browser has drawn none within {PICTURE_MS / 1000:.0f} s, twice", flush=True)

    def times_ms(self, path):
        """Durations of the questions of this path since the last call of `forget_times`."""
        script = "path => performance.getEntriesByType('resource').filter(e => e.name.endsWith(path)).map(e => e.responseEnd - e.startTime)"
        return self.page.evaluate(script, path)

    def forget_times(self):
        self.page.evaluate("performance.clearResourceTimings()")


def json_of(path):
    return json.loads(path.read_text())


def opens_once(studio, browser):
    """The link works once, its secret leaves the address, and the page is painted within a second."""
    page = studio.page
    page.goto(studio.link)
    expect(page.locator("#pile")).to_be_visible()
    assert page.url.split("#")[0].endswith("/") and "#" not in page.url, page.url
    cookie = studio.context.cookies()[0]
    assert cookie["httpOnly"] and cookie["sameSite"] == "Strict", cookie
    paint = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0]?.startTime")
    assert paint is not None, "nothing was painted"
    studio.paint_ms = paint
    other = browser.new_context().new_page()
    other.goto(studio.link)
    expect(other.locator("#closed")).to_be_visible()
    other.context.close()
    page.reload()
    expect(page.locator("#pile")).to_be_visible()


def table_point(page, x, y):
    """The place of a point of the table (m) on the screen."""
    script = """([x, y]) => {
      const area = document.querySelector('#ground .workspace').getBoundingClientRect();
      return [area.left + area.width * (x + 0.48) / 0.96, area.bottom - area.height * (y + 0.27) / 0.54];
    }"""
    return page.evaluate(script, [x, y])


def drag(page, start, end, steps=12):
    page.mouse.move(*start)
    page.mouse.down()
    for k in range(1, steps + 1):
        page.mouse.move(*(a + (b - a) * k / steps for a, b in zip(start, end)))
        page.wait_for_timeout(16)
    page.mouse.up()


def box_of(locator):
    """The place of an element on the screen; one that is drawn anew at this moment is asked for again."""
    for _ in range(100):
        if box := locator.bounding_box():
            return box
    raise AssertionError(f"{locator} is not on the screen")


def wait_until(page, holds):
    """Waits until something holds outside of the page."""
    for _ in range(FIT_MS // 100):
        if holds():
            return
        page.wait_for_timeout(100)
    raise AssertionError("what was waited for has not come")


def at_rest(page):
    """Waits until everything is computed with all worlds."""
    expect(page.locator("#probability-words")).to_contain_text("400 worlds", timeout=20_000)
    page.wait_for_timeout(400)
    expect(page.locator("#probability-words")).to_contain_text("400 worlds", timeout=20_000)


def eventually(holds, what, seconds=20):
    """Waits until a condition holds that the page does not show."""
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.05)


def learns_the_properties(studio):
    """From the films to the properties, with progress; the file is that of the command."""
    page = studio.page
    studio.go("learned")
    page.locator("#learned-output").fill("properties.json")
    page.locator("#learn").click()
    expect(page.locator("#stop-learning")).to_be_visible()
    expect(page.locator("#learned-charts figure")).to_have_count(5, timeout=120_000)
    assert studio.command("estimate", "campaign.toml", "-o", "command.json").returncode in (0, 3)
    written, wanted = ((studio.folder / name).read_bytes() for name in ("properties.json", "command.json"))
    assert written == wanted, "the properties are not those of `breakshot estimate`"
    (studio.folder / "command.json").unlink()
    shutil.rmtree(studio.folder / "tracks")
    studio.go("pile")
    expect(page.locator("#properties")).to_have_value("properties.json")


def makes_a_pile(studio):
    """Objects are dragged, touch and never overlap; the scene is saved with its comments."""
    page, scene = studio.page, studio.folder / "four.scene.toml"
    page.select_option("#scene", "four.scene.toml")
    expect(page.locator("#table .object")).to_have_count(4)
    at_rest(page)
    # Dragged onto another object it comes to lie beside it.
    drag(page, table_point(page, 0.0151, 0.0), table_point(page, -0.04, -0.02))
    expect(page.locator("#save")).to_be_enabled()
    at_rest(page)
    # One more by key, moved and turned by keys, and taken away.
    page.keyboard.press("n")
    expect(page.locator("#table .object")).to_have_count(5)
    page.locator('[data-object="a#2"]').focus()
    for key in ["ArrowLeft", "Shift+ArrowUp", "["]:
        page.keyboard.press(key)
        page.wait_for_timeout(80)
    page.keyboard.press("Delete")
    expect(page.locator("#table .object")).to_have_count(4)
    page.locator("#scene").focus()
    page.keyboard.press("Control+s")
    expect(page.locator("#message")).to_contain_text("Wrote four.scene.toml")
    text = scene.read_text()
    assert "# Four objects that touch." in text and "a#2" not in text, text
    # The program accepts it: nothing overlaps.
    page.locator("#heading").blur()
    page.keyboard.press("Control+S")
    expect(page.locator("#message")).to_contain_text("Wrote four.strike.json")
    simulated = studio.command("simulate", "four.scene.toml", "--properties", "properties.json", "--strike", "four.strike.json", "-o", "t.json")
    assert simulated.returncode in (0, 3), simulated.stderr


def makes_a_new_pile(studio):
    """A pile without a file: its scene is written, objects are added and pushed together, the map shows its strikes."""
    page = studio.page
    page.select_option("#scene", "+ new pile")
    page.fill("#new-name", "made.scene.toml")
    page.locator("#new-scene button.main").click()
    expect(page.locator("#message")).to_contain_text("Wrote made.scene.toml")
    for kind in ("a", "c"):
        page.select_option("#kind", kind)
        page.locator("#add").click()
    expect(page.locator("#table .object")).to_have_count(2)
    box = box_of(page.locator('[data-object="c"]'))
    other = box_of(page.locator('[data-object="a"]'))
    middle = lambda b: (b["x"] + b["width"] / 2, b["y"] + b["height"] / 2)
    drag(page, middle(box), (middle(other)[0] + 20, middle(other)[1] + 12))
    at_rest(page)
    page.locator("#play").blur()
    page.keyboard.press("m")
    expect(page.locator("#table .approach").first).to_be_visible(timeout=30_000)
    page.keyboard.press("b")
    at_rest(page)
    page.keyboard.press("Control+s")
    expect(page.locator("#message")).to_contain_text("Wrote made.scene.toml")
    page.keyboard.press("m")
    expect(page.locator("#table .approach")).to_have_count(0)
    page.select_option("#scene", "four.scene.toml")


def draws_walls_and_areas(studio):
    """A wall and a keep-out area are drawn with the mouse, moved with mouse and keys, taken away, and saved with the comments of the scene."""
    page, scene = studio.page, studio.folder / "four.scene.toml"
    before = scene.read_text()
    page.locator("#draw-wall").click()
    drag(page, table_point(page, 0.1, 0.18), table_point(page, 0.3, 0.18))
    expect(page.locator("#table .area.walls")).to_have_count(1)
    expect(page.locator("#draw-wall")).to_have_attribute("aria-pressed", "false")
    page.keyboard.press("k")
    drag(page, table_point(page, 0.2, -0.2), table_point(page, 0.3, -0.1))
    expect(page.locator("#table .area.keep_out")).to_have_count(1)
    # The corner of the area by the mouse, the wall by the keys.
    drag(page, table_point(page, 0.3, -0.1), table_point(page, 0.34, -0.08))
    page.locator("#table .area.walls").focus()
    page.keyboard.press("Shift+ArrowUp")
    page.wait_for_timeout(150)
    at_rest(page)
    page.keyboard.press("Control+s")
    expect(page.locator("#message")).to_contain_text("Wrote four.scene.toml")
    written = tomllib.loads(scene.read_text())
    assert "# Four objects that touch." in scene.read_text()
    (wall,), (area,) = written["walls"], written["keep_out"]
    near = lambda p, q: all(abs(a - b) < 0.004 for a, b in zip(p, q))
    assert near(wall["from_m"], [0.1, 0.19]) and near(wall["to_m"], [0.3, 0.19]), wall
    assert near(area["points_m"][0], [0.2, -0.2]) and near(area["points_m"][2], [0.34, -0.08]), area
    # One more from the keyboard, and all are taken away.
    page.locator("#play").focus()
    page.keyboard.press("w")
    page.locator("#table .area.walls").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#table .area.walls")).to_have_count(2)
    for kind in ("walls", "walls", "keep_out"):
        page.locator(f"#table .area.{kind}").first.focus()
        page.keyboard.press("Delete")
    expect(page.locator("#table .area")).to_have_count(0)
    page.keyboard.press("Control+s")
    expect(page.locator("#message")).to_contain_text("Wrote four.scene.toml")
    # The message of the first time may still be shown.
    eventually(lambda: tomllib.loads(scene.read_text()) == tomllib.loads(before), "the scene is saved as it was")


def drags_the_strike(studio):
    """The strike follows the mouse; motion and cloud come within their bounds."""
    page = studio.page
    at_rest(page)
    studio.forget_times()
    before = page.input_value("#heading")
    for name, by in [("cue", (-40, 60)), ("tip", (30, -12)), ("start", (-14, 22)), ("cue", (30, -50))]:
        box = box_of(page.locator(f"#table .handle.{name}"))
        middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        drag(page, middle, (middle[0] + by[0], middle[1] + by[1]), steps=40)
    assert page.input_value("#heading") != before
    motion, cloud = studio.times_ms("/api/motion"), studio.times_ms("/api/cloud")
    at_rest(page)
    return {"motion": motion, "cloud of 60 worlds": cloud}


def shows_what_the_commands_write(studio):
    """Trajectory and plan on the page are those of the commands, to the last digit."""
    page, folder = studio.page, studio.folder
    page.select_option("#scene", "pile.scene.toml")
    page.select_option("#strike-source", "pile.strike.json")
    at_rest(page)
    files = ["--properties", "properties.json"]
    assert studio.command("simulate", "pile.scene.toml", *files, "--strike", "pile.strike.json", "-o", "t.json").returncode in (0, 3)
    ask = """async (strike) => (await fetch('/api/motion', {method: 'POST', headers: {'Content-Type': 'application/json'},
      body: JSON.stringify({pile: {scene: 'pile.scene.toml'}, properties: 'properties.json', strike})})).text()"""
    # As text: JavaScript writes large numbers with other digits.
    shown = json.loads(page.evaluate(ask, json_of(folder / "pile.strike.json")))["trajectory"]
    assert shown == json_of(folder / "t.json"), "the motion is not that of `breakshot simulate`"

    page.keyboard.press("Escape")
    page.fill("#plan-file", "page.plan.json")
    page.locator("#plan").click()
    expect(page.locator("#planned")).to_be_visible(timeout=60_000)
    assert studio.command("plan", "pile.scene.toml", *files, "-o", "command.plan.json").returncode in (0, 3)
    plan = folder / "page.plan.json"
    assert plan.read_bytes() == (folder / "command.plan.json").read_bytes(), "the plan is not that of `breakshot plan`"
    robustness = json_of(plan)["robustness"]
    at_rest(page)
    wanted = f"{100 * robustness['success_probability']:.0f}\u00a0%"
    expect(page.locator("#probability")).to_have_text(wanted)
    expect(page.locator("#show-runner-up")).to_be_visible()
    page.locator("#show-runner-up").click()
    at_rest(page)
    page.locator("#show-plan").click()
    at_rest(page)


def plays_the_motion(studio):
    page = studio.page
    page.locator("#play").focus()
    time = lambda: float(page.get_attribute("#timeline", "aria-valuenow"))
    page.locator("#timeline").focus()
    page.keyboard.press("End")
    end = time()
    assert end > 0.1, end
    page.keyboard.press("Control+ArrowLeft")
    assert 0 < time() < end
    page.keyboard.press("Home")
    page.keyboard.press("Control+ArrowRight")
    expect(page.locator("#event")).to_contain_text("striker hits")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Space")
    page.wait_for_timeout(300)
    page.keyboard.press("Space")
    played = time()
    page.keyboard.press("Home")
    assert played > 0 and time() == 0, played
    page.keyboard.press("?")
    expect(page.locator("#keys")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#keys")).to_be_hidden()


def shows_the_decoder_s_frames(studio, film):
    """The clip that is open shows the luma of this film, byte for byte, in every frame, or in some frames of a program that is no release build."""
    page = studio.page
    if not shutil.which("ffmpeg"):
        print(f"SKIPPED the frames of {film.name} on the screen: the program `ffmpeg` is not installed")
        return
    decoded = subprocess.run(["ffmpeg", "-v", "error", "-i", film, "-f", "rawvideo", "-pix_fmt", "gray", "-vf", "extractplanes=y", "-fps_mode", "passthrough", "-"], capture_output=True, check=True).stdout
    expect(page.locator("#clips [aria-current]")).to_contain_text(film.stem)
    count = int(page.get_attribute("#film-position", "max")) + 1
    expect(page.locator("#film-time")).to_contain_text(f"1/{count}", timeout=FIT_MS)
    size = page.evaluate("(({width, height}) => width * height)(document.querySelector('#frame'))")
    assert len(decoded) == count * size, f"{film.name}: {count} frames of {size} pixels, but {len(decoded)} bytes"
    on_screen = """async (number) => {
      const canvas = document.querySelector('#frame'), position = document.querySelector('#film-position');
      if (Number(canvas.dataset.frame) !== number) await new Promise((done) => {
        new MutationObserver((_, self) => { if (Number(canvas.dataset.frame) === number) { self.disconnect(); done(); } }).observe(canvas, {attributeFilter: ['data-frame']});
        position.value = number;
        position.dispatchEvent(new Event('input'));
      });
      const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height), luma = new Uint8Array(data.length / 4);
      for (let k = 0; k < luma.length; k += 1) luma[k] = data[4 * k];
      return Array.from(new Uint8Array(await crypto.subtle.digest('SHA-256', luma)));
    }"""
    frames = sorted({*range(0, count, studio.every), count - 1})
    for frame in frames:
        wanted = hashlib.sha256(decoded[frame * size : (frame + 1) * size]).digest()
        assert bytes(page.evaluate(on_screen, frame)) == wanted, f"frame {frame} on the screen is not that of {film.name}"
    studio.compared += len(frames)


def steps_through_films(studio):
    """A clip is tracked; steps forth and back come home; frames on the screen are those of every film, byte for byte."""
    page = studio.page
    studio.go("films")
    expect(page.locator("#clips button")).to_have_count(12)
    page.locator("#clips button", has_text="pair_a_c_3").click()
    expect(page.locator("#film-time")).to_contain_text("1/48")
    page.keyboard.press("t")
    expect(page.locator("#impacts")).to_contain_text("a hits c", timeout=60_000)
    assert (studio.folder / "tracks/pair_a_c_3.json").exists()
    # The film has run along with its tracking, and is back.
    expect(page.locator("#frame")).to_have_attribute("data-frame", "0")
    page.locator("#clips button", has_text="pair_a_c_3").focus()
    steps = []
    for key in ["ArrowRight"] * 30 + ["ArrowLeft"] * 30:
        # A key that is held comes thirty times a second.
        page.wait_for_timeout(33)
        steps.append(page.evaluate("""key => new Promise(done => {
          const canvas = document.querySelector('#frame'), before = canvas.dataset.frame, start = performance.now();
          new MutationObserver((_, self) => { self.disconnect(); done(performance.now() - start); }).observe(canvas, {attributeFilter: ['data-frame']});
          document.activeElement.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
        })""", key))
    assert page.get_attribute("#frame", "data-frame") == "0"
    # Steps while the campaign is read again, as after a change of its files: none is lost.
    with page.expect_response(lambda answer: "/api/clip?" in answer.url):
        page.evaluate("document.dispatchEvent(new Event('learned'))")
        for _ in range(5):
            page.keyboard.press("ArrowRight")
    page.wait_for_timeout(500)
    expect(page.locator("#frame")).to_have_attribute("data-frame", "5")
    expect(page.locator("#film-position")).to_have_value("5")
    page.keyboard.press("Home")
    expect(page.locator("#frame")).to_have_attribute("data-frame", "0")
    for film in sorted(studio.folder.glob("*_*.mp4")):
        page.locator("#clips button", has_text=film.stem).click()
        shows_the_decoder_s_frames(studio, film)
    page.locator("#clips button", has_text="pair_a_c_3").click()
    expect(page.locator("#impacts")).to_contain_text("a hits c", timeout=FIT_MS)
    page.keyboard.press("Home")
    page.keyboard.press("Control+ArrowRight")
    page.wait_for_timeout(200)
    page.keyboard.press("Control+ArrowRight")
    page.wait_for_timeout(300)
    expect(page.locator("#overlay .found")).to_have_count(2)
    return {"step of a film": steps}


def changes_the_campaign(studio):
    """A film is added, a clip and a stretch are left out, objects are renamed; the next estimate shows what that changes; undo writes the text before."""
    page, campaign = studio.page, studio.folder / "campaign.toml"
    studio.go("films")
    text = campaign.read_text()
    page.set_input_files("#film-picker", str(studio.folder.parent / "pile_a_c_e.mp4"))
    expect(page.locator("#new-films")).to_be_visible()
    expect(page.locator("#new-film-list input")).to_have_value("a, c, e")
    page.locator("#new-films button.main").click()
    expect(page.locator("#clips button")).to_have_count(13)
    expect(page.locator("#clips [aria-current]")).to_contain_text("pile_a_c_e.mp4")
    assert (studio.folder / "pile_a_c_e.mp4").read_bytes() == (studio.folder / "pile.mp4").read_bytes()
    shows_the_decoder_s_frames(studio, studio.folder / "pile_a_c_e.mp4")
    print(f"{studio.compared} frames on the screen are those of the films, byte for byte (every {studio.every}. frame of each)")
    assert campaign.read_text().startswith(text)
    # The same name once more is refused.
    page.set_input_files("#film-picker", str(studio.folder.parent / "pile_a_c_e.mp4"))
    expect(page.locator("#message")).to_contain_text("taken")
    expect(page.locator("#new-films")).to_be_hidden()
    page.locator("#film-position").focus()
    page.keyboard.press("Control+z")
    expect(page.locator("#clips button")).to_have_count(12)
    assert campaign.read_text() == text, "undo does not write the text before"
    # Left out as a whole, by key, and taken in again.
    page.locator("#clips button", has_text="single_e_5").click()
    page.locator("#film-back").focus()
    page.keyboard.press("x")
    expect(page.locator("#clips button", has_text="single_e_5")).to_contain_text("left out")
    assert "exclude = true" in campaign.read_text()
    page.keyboard.press("Control+z")
    expect(page.locator("#clips button", has_text="single_e_5")).not_to_contain_text("left out")
    expect(page.locator("#message")).to_contain_text("Took back")
    # Another object, refused and back, then a stretch.
    page.fill("#clip-objects", "nobody")
    page.keyboard.press("Enter")
    expect(page.locator("#message")).to_contain_text("nobody")
    expect(page.locator("#clip-objects")).to_have_value("e")
    page.locator("#film-position").focus()
    # A stretch begins and ends at the frame that is shown.
    for key, frame in (("Home", "0"), ("PageDown", "10")):
        page.keyboard.press(key)
        expect(page.locator("#frame")).to_have_attribute("data-frame", frame)
    page.keyboard.press("s")
    expect(page.locator("#stretch")).to_contain_text("until here")
    page.keyboard.press("PageDown")
    expect(page.locator("#frame")).to_have_attribute("data-frame", "20")
    page.keyboard.press("s")
    expect(page.locator("#stretches li")).to_have_count(1)
    expect(page.locator("#clips button", has_text="single_e_5")).to_contain_text("in part left out")
    assert "exclude = [[" in campaign.read_text() and "# Two strikes of every object alone" in campaign.read_text()
    studio.go("learned")
    page.locator("#learn").click()
    expect(page.locator("#before-words")).to_be_visible(timeout=120_000)
    assert page.locator(".mean-before").count() >= 12
    assert page.locator(".number-before").first.text_content().startswith("was ")
    studio.picture(studio.shots / "learned-before.png")
    studio.go("films")
    page.locator("#stretches button").click()
    expect(page.locator("#message")).to_contain_text("Wrote campaign.toml")
    expect(page.locator("#stretches li")).to_have_count(0)
    page.locator("#undo").click()
    expect(page.locator("#stretches li")).to_have_count(1)
    page.locator("#undo").click()
    expect(page.locator("#stretches li")).to_have_count(0)
    expect(page.locator("#undo")).to_be_disabled()
    # What was refused on purpose is in the browser's log.
    studio.problems = [problem for problem in studio.problems if "422" not in problem]
    assert campaign.read_text() == text, "undo does not write the text before"


def opens_a_clip_from_its_value(studio):
    page = studio.page
    studio.go("learned")
    expect(page.locator("#learned-charts figure")).to_have_count(5)
    page.locator('[aria-label="Restitution between objects"] .clip-mark[aria-label^="pair_a_c_3"]').focus()
    page.keyboard.press("Enter")
    expect(page.locator("#films")).to_be_visible()
    expect(page.locator("#clips [aria-current]")).to_contain_text("pair_a_c_3")
    expect(page.locator("#film-time")).not_to_contain_text("1/48")


def true_minus(text):
    """A number as the page writes it."""
    return text.replace("-", "\u2212") if float(text) else text.replace("-", "")


def cells_of(row):
    return [cell.strip() for cell in row.locator("td").all_text_contents()]


def compares_film_and_simulation(studio):
    """A comparison is that of `breakshot verify`, file by file and number by number; film and simulation are shown in step."""
    page, folder = studio.page, studio.folder
    studio.go("compare")
    expect(page.locator("#compare-none")).to_be_visible()
    page.select_option("#compare-scene", "pile.scene.toml")
    expect(page.locator("#compare-film-file")).to_have_value("pile.mp4")
    expect(page.locator("#compare-strike")).to_have_value("pile.strike.json")
    page.locator("#compare-output").fill("verified")
    page.locator("#compare-start").focus()
    page.keyboard.press("c")
    expect(page.locator("#message")).to_contain_text("Wrote verified/report.json", timeout=60_000)
    expect(page.locator("#compare-pairs tbody tr")).to_have_count(3)
    arguments = ["verify", "pile.scene.toml", "pile.mp4", "--properties", "properties.json", "--strike", "pile.strike.json", "-o", "command.verified"]
    assert studio.command(*arguments).returncode in (0, 3)
    for name in ("report.json", "tracks.json", "trajectory.json", "distances.csv"):
        written, wanted = ((folder / where / name).read_bytes() for where in ("verified", "command.verified"))
        assert written == wanted, f"{name} is not that of `breakshot verify`"
    report = json_of(folder / "verified/report.json")
    for k, pair in enumerate(report["pairs"]):
        *_, filmed, simulated, difference = cells_of(page.locator("#compare-pairs tbody tr").nth(k))
        wanted = [f"{1e3 * pair[key]:.1f}" for key in ("observed_m", "predicted_m")] + [true_minus(f"{1e3 * pair['difference_m']:+.1f}")]
        assert [filmed, simulated, difference] == wanted, (pair, filmed, simulated, difference)
    for k, of in enumerate(report["objects"]):
        shown = cells_of(page.locator("#compare-objects tbody tr").nth(k))
        assert shown[:4] == [f"{1e3 * of[key]:.1f}" for key in ("placement_error_m", "observed_way_m", "predicted_way_m", "position_error_m")], (of, shown)
    expect(page.locator("#compare-mean")).to_have_text(f"{1e3 * report['summary']['all']['mean_m']:.1f} mm")
    # The reasons are the sentences of the command's page; one with a time leads there.
    html = (folder / "command.verified/report.html").read_text()
    reasons = page.locator("#compare-reasons li").all_text_contents()
    assert len(reasons) > 3 and all(f"<li>{reason}</li>" in html for reason in reasons), reasons
    divergence = report["alignment"]["divergences"][0]
    page.locator("#compare-reasons button").first.click()
    frame = lambda: int(page.get_attribute("#compare-frame", "data-frame"))
    at = lambda: float(page.text_content("#compare-time").replace("\u2212", "-").split()[0])
    named = lambda: int(page.text_content("#compare-event").split("frame ")[1].split()[0]) - 1
    wait_until(page, lambda: abs(at() - divergence["time_s"]) < 0.02 and frame() == named())
    # A step is a frame of the film, in both drawings.
    before, time = frame(), at()
    page.locator("#compare-play").blur()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#compare-frame")).to_have_attribute("data-frame", str(before + 1))
    assert 0.01 < at() - time < 0.03, (before, frame(), time, at())
    expect(page.locator("#compare-overlay .found")).to_have_count(3)
    expect(page.locator("#compare-overlay .simulated")).to_have_count(3)
    tracks = json_of(folder / "verified/tracks.json")["tracks"]
    a, b = (next(t for t in tracks if t["object"] == report["pairs"][0][key])["samples"][frame()] for key in ("a", "b"))
    now = cells_of(page.locator("#compare-pairs tbody tr").first)[0]
    assert now == f"{1e3 * ((a['x_m'] - b['x_m']) ** 2 + (a['y_m'] - b['y_m']) ** 2) ** 0.5:.1f}", now
    selected = page.locator("#compare-pairs [aria-current]")
    worst = max(report["pairs"], key=lambda pair: abs(pair["difference_m"]))
    expect(selected).to_contain_text(f"{worst['a']} \u2013 {worst['b']}")
    page.keyboard.press("]")
    expect(selected).not_to_contain_text(f"{worst['a']} \u2013 {worst['b']}")
    for film, table in ((True, False), (False, True), (True, True)):
        page.keyboard.press("b")
        expect(page.locator("#compare-film")).to_be_visible(visible=film)
        expect(page.locator("#compare-table")).to_be_visible(visible=table)
    shutil.rmtree(folder / "command.verified")


def moves_a_tag(studio):
    """The fit is that of `breakshot calibrate`, also with a tag elsewhere; what is saved keeps the comments."""
    page, file = studio.page, studio.folder / "cell.toml"
    studio.go("cell")
    rows = page.locator("#cell-tags tbody tr")
    expect(rows).to_have_count(4, timeout=FIT_MS)

    def is_the_command_s(cell):
        found = studio.command("calibrate", cell, "pile.mp4", "--json")
        camera = json.loads(found.stdout)["camera"]
        for k, tag in enumerate(camera["tags"]):
            for column, wanted in ((3, f"{tag['rms_px']:.3f}"), (4, f"{1e3 * tag['rms_m']:.3f}")):
                expect(rows.nth(k).locator("td").nth(column)).to_have_text(wanted, timeout=FIT_MS)
        expect(page.locator("#cell-rms")).to_have_text(f"{1e3 * camera['reprojection_rms_m']:.3f} mm")

    page.select_option("#cell-film", "pile.mp4")
    is_the_command_s("cell.toml")
    text = file.read_text()
    moved = text.replace("center_m = [0.4, -0.21]", "center_m = [0.4013, -0.21]")
    (studio.folder / "moved.cell.toml").write_text(moved)
    page.fill('[aria-label="x in mm of tag 1"]', "401.3")
    expect(rows.nth(1)).to_contain_text("edited", timeout=FIT_MS)
    is_the_command_s("moved.cell.toml")
    assert file.read_text() == text, "an edit alone writes nothing"
    # One more with the keys, and with the mouse; then everything as it was.
    tag = page.locator('#cell-overlay [data-tag="1"]')
    tag.focus()
    page.keyboard.press("Shift+ArrowUp")
    expect(page.locator('[aria-label="y in mm of tag 1"]')).to_have_value("-209")
    box = box_of(page.locator('#cell-overlay [data-tag="1"] .tag-reach'))
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    drag(page, middle, (middle[0] + 3, middle[1]), steps=4)
    assert float(page.input_value('[aria-label="x in mm of tag 1"]')) > 402
    # Positions with which no camera fits: the reason is shown, and they are not saved.
    page.fill('[aria-label="x in mm of tag 1"]', "500")
    page.fill('[aria-label="x in mm of tag 2"]', "430")
    expect(page.locator("#cell-error")).to_contain_text("tags that are", timeout=FIT_MS)
    expect(page.locator("#cell-save")).to_be_disabled()
    page.locator('[aria-label="x in mm of tag 2"]').blur()
    page.keyboard.press("u")
    is_the_command_s("cell.toml")
    expect(page.locator("#cell-error")).to_be_hidden()
    studio.problems = [problem for problem in studio.problems if "422" not in problem]
    expect(page.locator("#cell-save")).to_be_disabled()
    page.select_option("#cell-scene", "pile.scene.toml")
    expect(page.locator("#cell-overlay .object-top")).to_have_count(3, timeout=FIT_MS)
    page.fill('[aria-label="x in mm of tag 1"]', "401.3")
    expect(page.locator("#cell-save")).to_be_enabled()
    page.keyboard.press("Control+s")
    expect(page.locator("#message")).to_contain_text("Wrote cell.toml")
    assert file.read_text() == moved, file.read_text()
    # The keys of the views do not count where numbers are written.
    page.locator('[aria-label="x in mm of tag 1"]').blur()
    file.write_text(text)
    (studio.folder / "moved.cell.toml").unlink()


def shows_the_arm(studio):
    """The joint path is that of `breakshot command`; a cell without an arm gets a sentence."""
    page = studio.page
    studio.go("robot")
    expect(page.locator("#robot-reason")).to_contain_text("add [robot]", timeout=FIT_MS)
    page.select_option("#robot-strike", "pile.strike.json")
    page.select_option("#robot-scene", "pile.scene.toml")
    page.select_option("#robot-cell", "robot.cell.toml")
    expect(page.locator("#robot-shown")).to_be_visible(timeout=30_000)
    found = studio.command("command", "pile.strike.json", "--cell", "robot.cell.toml", "--scene", "pile.scene.toml", "-o", "command.json", "--json")
    summary = json.loads(found.stdout)
    expect(page.locator("#robot-speed")).to_have_text(f"{summary['stroke']['contact_speed_m_s']:.3f} m/s")
    expect(page.locator("#robot-stroke")).to_contain_text(summary["hash"])
    expect(page.locator("#robot-checks li")).to_have_count(len(summary["checks"]))
    command = json_of(studio.folder / "command.json")
    text = page.text_content("#robot-speeds")
    for joint, name in enumerate(command["joints"]):
        most = max(abs(qd[joint]) for phase in command["phases"] for qd in phase["qd_rad_s"])
        assert f"{name}{most:.2f} of" in text, (name, most, text)
    # It is shown at the contact; the phases are stepped through.
    expect(page.locator("#robot-event")).to_contain_text("strike")
    page.locator("#robot-play").blur()
    page.keyboard.press("Control+ArrowRight")
    expect(page.locator("#robot-event")).to_contain_text("drawing back")
    page.keyboard.press("k")
    expect(page.locator("#robot-event")).to_contain_text("strike")
    expect(page.locator("#robot-above .arm")).to_have_count(1)
    (studio.folder / "command.json").unlink()


def is_accessible(studio, view):
    """axe-core finds nothing serious."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(studio.page, options={"resultTypes": ["violations"]}).response["violations"]
    serious = [f"{v['id']}: {[n['html'][:120] for n in v['nodes'][:3]]}" for v in found if v["impact"] in ("serious", "critical")]
    assert not serious, f"{view}: {serious}"


def corrects_a_start(studio):
    """Objects are moved to where they are in the first frame, with the mouse and the keys; the tracking begins there; undo writes the text before."""
    page, campaign = studio.page, studio.folder / "campaign.toml"
    studio.go("films")
    text = campaign.read_text()
    page.locator("#clips button", has_text="pair_a_c_3").click()
    expect(page.locator("#film-time")).to_contain_text("1/48")
    page.locator("#film-back").focus()
    page.keyboard.press("c")
    expect(page.locator("#starts .start")).to_have_count(2, timeout=FIT_MS)
    expect(page.locator("#overlay .found")).to_have_count(0)
    studio.picture(studio.shots / "films-starts.png")
    middle = lambda name: (lambda b: (b["x"] + b["width"] / 2, b["y"] + b["height"] / 2))(box_of(page.locator(f'[data-start="{name}"] .start-center')))
    # `a` is dragged to where `c` is: their markers look alike.
    first = json_of(studio.folder / "tracks/pair_a_c_3.json")["tracks"]
    was = {track["object"]: (track["samples"][0]["x_m"], track["samples"][0]["y_m"]) for track in first}
    drag(page, middle("a"), middle("c"))
    expect(page.locator("#given-starts li")).to_have_count(1, timeout=FIT_MS)
    expect(page.locator("#given-starts")).to_contain_text("a begins at")
    written = tomllib.loads(campaign.read_text())["clips"][7]["starts"]
    assert [start["object"] for start in written] == ["a"] and "# Two strikes of every object alone" in campaign.read_text()
    # By the keys a millimetre.
    page.locator('[data-start="a"]').focus()
    page.keyboard.press("ArrowRight")
    start = lambda: tomllib.loads(campaign.read_text())["clips"][7]["starts"][0]["position_m"]
    wait_until(page, lambda: start() != written[0]["position_m"])
    moved = start()
    assert abs(moved[0] - written[0]["position_m"][0] - 0.001) < 2e-4, (written, moved)
    page.keyboard.press("Escape")
    expect(page.locator("#starts")).to_be_hidden()
    page.locator("#film-back").focus()
    page.keyboard.press("t")
    expect(page.locator("#message")).to_contain_text("Wrote tracks/pair_a_c_3.json", timeout=60_000)
    begins = json_of(studio.folder / "tracks/pair_a_c_3.json")["tracks"][0]["samples"][0]
    off = math.dist((begins["x_m"], begins["y_m"]), was["c"])
    assert off < 0.01, f"`a` begins {off} m from where it was put"
    for left in (1, 0):
        page.keyboard.press("Control+z")
        expect(page.locator("#message")).to_contain_text("Took back")
        expect(page.locator("#given-starts li")).to_have_count(left, timeout=FIT_MS)
        page.locator("#film-back").focus()
    assert campaign.read_text() == text, "undo does not write the text before"
    page.keyboard.press("t")
    expect(page.locator("#impacts")).to_contain_text("a hits c", timeout=60_000)


def takes_a_pile_from_a_picture(studio):
    """A scene from a picture is that of `breakshot look`, byte for byte; the picture lies beneath the objects."""
    page, folder = studio.page, studio.folder
    studio.go("pile")
    assert studio.command("look", "cell.toml", "objects.toml", "pile_a_c_e.mp4", "--objects", "a,c,e", "-o", "command.scene.toml").returncode in (0, 3)
    page.locator("#play").focus()
    page.keyboard.press("f")
    expect(page.locator("#new-picture")).to_be_visible()
    page.select_option("#picture-file", "pile_a_c_e.mp4")
    expect(page.locator("#picture-names")).to_have_value("a, c, e")
    page.fill("#picture-name", "taken.scene.toml")
    page.locator("#new-picture button.main").click()
    expect(page.locator("#message")).to_contain_text("Wrote taken.scene.toml", timeout=FIT_MS)
    expect(page.locator("#table .object")).to_have_count(3)
    assert (folder / "taken.scene.toml").read_bytes() == (folder / "command.scene.toml").read_bytes(), "the scene is not that of `breakshot look`"
    expect(page.locator("#ground image")).to_have_count(1)
    page.wait_for_timeout(1500)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        studio.picture(studio.shots / f"pile-picture-{scheme}.png")
    page.emulate_media(color_scheme="light")
    page.locator("#play").focus()
    page.keyboard.press("i")
    expect(page.locator("#ground image")).to_have_count(0)
    # A picture that is dropped is copied into the folder; one that is none is refused.
    page.set_input_files("#picture-picker", {"name": "none.png", "mimeType": "image/png", "buffer": b"none"})
    expect(page.locator("#message.error")).to_be_visible(timeout=FIT_MS)
    assert not (folder / "none.png").exists()
    # A motion that comes afterwards does not hide the reason.
    page.locator("#properties").dispatch_event("change")
    page.wait_for_timeout(1500)
    expect(page.locator("#message.error")).to_be_visible()
    studio.problems = [problem for problem in studio.problems if "422" not in problem]
    (folder / "command.scene.toml").unlink()
    page.select_option("#scene", "pile.scene.toml")


def shows_what_others_write(studio):
    """Files that another program writes show up by themselves."""
    page, scene = studio.page, studio.folder / "made.scene.toml"
    studio.go("pile")
    page.select_option("#scene", "made.scene.toml")
    expect(page.locator("#table .object")).to_have_count(2)
    text = scene.read_text()
    scene.write_text(text + '\n[[placed]]\nobject = "e"\nposition_m = [0.3, 0.15]\n')
    expect(page.locator("#table .object")).to_have_count(3, timeout=FIT_MS)
    expect(page.locator("#message")).to_contain_text("changed by another program")
    shutil.copy(scene, studio.folder / "other.scene.toml")
    expect(page.locator("#scene option", has_text="other.scene.toml")).to_have_count(1, timeout=FIT_MS)
    (studio.folder / "other.scene.toml").unlink()
    scene.write_text(text)
    expect(page.locator("#table .object")).to_have_count(2, timeout=FIT_MS)
    page.select_option("#scene", "pile.scene.toml")


def says_what_to_film_next(studio):
    """The advice is that of `breakshot estimate --advise 5`."""
    page = studio.page
    studio.go("learned")
    # The properties of the campaign as it is now: the last estimate on the page left out a stretch. The page reads them anew by itself.
    found = studio.command("estimate", "campaign.toml", "-o", "properties.json", "--tracks", "tracks", "--advise", "5", "--json")
    page.wait_for_timeout(5000)
    page.locator("#advise").click()
    expect(page.locator("#advice tbody tr")).to_have_count(5, timeout=120_000)
    clips = json.loads(found.stdout)["advice"]["clips"]
    rows = [[cell.strip() for cell in row.locator("th, td").all_text_contents()] for row in page.locator("#advice tbody tr").all()]
    for row, clip in zip(rows, clips):
        assert row[1] == clip["strike"] and row[3] == f"{clip['speed_m_s']:.2f}" and row[5] == f"{1e3 * clip['spread_m']:.2f}", (row, clip)


def has_a_key_for_every_action(studio):
    """Whatever can be pressed in a view is named in its list of keys, or is one of a list that the keyboard walks through."""
    page = studio.page
    for view in KEYS_OF_VIEWS:
        studio.go(view)
        found = page.evaluate("""view => [...document.querySelectorAll(`#${view} :is(button, input[type=checkbox])`)]
          .filter(e => !e.hidden && !e.closest('[hidden]') && e.offsetParent)
          .map(e => ({words: e.textContent.trim() || e.ariaLabel || e.id, id: e.id, key: e.ariaKeyShortcuts ?? e.getAttribute('aria-keyshortcuts'), inList: Boolean(e.closest('ul, table, summary, .fields')), tab: e.tabIndex}))""", view)
        steps = ("-back", "-forth", "back", "forth")
        bare = [one for one in found if not one["key"] and not one["inList"] and not one["id"].endswith(steps) and not one["id"].endswith("-cancel")]
        assert not bare, f"{view}: without a key: {bare}"
        assert all(one["tab"] >= 0 for one in found), f"{view}: not reached by Tab: {found}"
        page.evaluate("document.activeElement.blur()")
        page.keyboard.press("?")
        listed = page.locator("#key-list").inner_text()
        keys = {key for one in found if one["key"] for key in one["key"].split(" ")}
        names = {"Control": "Ctrl", "Space": "Space"}
        for key in keys:
            for part in key.split("+"):
                assert not part or names.get(part, part).lower() in listed.lower(), f"{view}: {key} is not in the list of keys"
        page.keyboard.press("Escape")


def goes_from_films_to_a_comparison(studio):
    """With films and properties: a pile from a film's first frames, its plan, its simulation, the comparison with the film, and a model for another simulator."""
    page, folder = studio.page, studio.folder
    studio.go("pile")
    expect(page.locator("#new-scene")).to_be_visible(timeout=FIT_MS)
    page.keyboard.press("Escape")
    expect(page.locator("#new-scene")).to_be_hidden()
    page.locator("#play").focus()
    page.keyboard.press("f")
    expect(page.locator("#new-picture")).to_be_visible()
    page.select_option("#picture-file", "pair_a_c_3.mp4")
    page.fill("#picture-name", "pair.scene.toml")
    page.locator("#new-picture button.main").click()
    expect(page.locator("#message")).to_contain_text("Wrote pair.scene.toml", timeout=FIT_MS)
    expect(page.locator("#table .object")).to_have_count(2)
    at_rest(page)
    page.locator("#play").focus()
    page.keyboard.press("p")
    expect(page.locator("#planned")).to_be_visible(timeout=120_000)
    assert json_of(folder / "plan.json")["strike"], "the plan has no strike"
    # The strike of the film, as the robot was told: typed, simulated, saved.
    for field, value in (("heading", "2.415"), ("speed", "0.5"), ("travel", "68"), ("start-x", "-270.11"), ("start-y", "33.33")):
        page.fill(f"#{field}", value)
    page.locator("#play").focus()
    at_rest(page)
    page.keyboard.press("End")
    assert float(page.get_attribute("#timeline", "aria-valuenow")) > 0.1
    page.keyboard.press("Home")
    page.keyboard.press("Control+Shift+S")
    expect(page.locator("#message")).to_contain_text("Wrote pair.strike.json")
    page.keyboard.press("x")
    expect(page.locator("#message")).to_contain_text("Wrote pair.xml")
    files = ["pair.scene.toml", "--properties", "properties.json", "--strike", "pair.strike.json"]
    assert studio.command("export", *files, "--to", "mjcf", "-o", "command.xml").returncode in (0, 3)
    assert (folder / "pair.xml").read_bytes() == (folder / "command.xml").read_bytes(), "the model is not that of `breakshot export`"
    studio.go("compare")
    # New files show up by themselves.
    expect(page.locator("#compare-strike option", has_text="pair.strike.json")).to_have_count(1, timeout=FIT_MS)
    for choice, value in (("scene", "pair.scene.toml"), ("film-file", "pair_a_c_3.mp4"), ("strike", "pair.strike.json"), ("properties", "properties.json")):
        page.select_option(f"#compare-{choice}", value)
    page.locator("#compare-start").click()
    expect(page.locator("#compare-pairs tbody tr")).to_have_count(1, timeout=60_000)
    report = json_of(next(folder.glob("*/report.json")))
    expect(page.locator("#compare-mean")).to_have_text(f"{1e3 * report['summary']['all']['mean_m']:.1f} mm")


def begins_in_an_empty_folder(program, demo, browser, shots):
    """A person's whole way, from an empty folder: templates, a cell and objects as an editor saves them, films, an estimate, a pile, a comparison."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder) / "mine"
        folder.mkdir()
        studio = Studio(program, folder, browser)
        page = studio.page
        try:
            page.goto(studio.link)
            expect(page.locator("#fresh")).to_be_visible()
            studio.picture(shots / "empty.png")
            is_accessible(studio, "the empty folder")
            page.keyboard.press("Alt+0")
            expect(page.locator("#message")).to_contain_text("Wrote cell.toml, objects.toml")
            expect(page.locator("#fresh")).to_be_hidden()
            assert studio.command("calibrate", "cell.toml", str(demo / "pile.mp4")).returncode == 2, "the template is not this cell"
            # The person measures the cell, and writes the files in an editor; then the films.
            for name in ("cell.toml", "objects.toml"):
                shutil.copy(demo / name, folder / name)
            (folder / "scene.toml").unlink()
            studio.go("films")
            expect(page.locator("#plots-words")).to_contain_text("No films yet", timeout=FIT_MS)
            names = ["single_a_3.mp4", "single_a_5.mp4", "pair_a_c_1.mp4", "pair_a_c_3.mp4"]
            page.set_input_files("#film-picker", [str(demo / name) for name in names])
            expect(page.locator("#new-film-list input")).to_have_count(len(names))
            page.locator("#new-films button.main").click()
            expect(page.locator("#clips button")).to_have_count(len(names), timeout=FIT_MS)
            clips = tomllib.loads((folder / "campaign.toml").read_text())["clips"]
            assert [clip["objects"] for clip in clips] == [["a"], ["a"], ["a", "c"], ["a", "c"]], clips
            studio.go("cell")
            expect(page.locator("#cell-tags tbody tr")).to_have_count(4, timeout=FIT_MS)
            studio.go("learned")
            page.keyboard.press("e")
            expect(page.locator("#learned-charts figure").first).to_be_visible(timeout=120_000)
            assert "a" in json_of(folder / "properties.json")["friction"]
            goes_from_films_to_a_comparison(studio)
            studio.problems = [problem for problem in studio.problems if "422" not in problem]
            assert not studio.problems, studio.problems
        finally:
            studio.close()


def tells_nothing_by_colour_alone(studio, view):
    """Every curve and outline that has an object's colour has its name at it, and every good or bad outcome is told in words."""
    page = studio.page
    unnamed = page.evaluate("""(view) => {
      const seen = (e) => e.checkVisibility() && e.getBoundingClientRect().width > 0;
      const isName = (e) => /name/.test(e.getAttribute('class') ?? '') || e.closest('.object');
      // Room between an outline and its name (px).
      const ROOM = 24;
      const touches = (a, b) => a.left < b.right + ROOM && b.left < a.right + ROOM && a.top < b.bottom + ROOM && b.top < a.bottom + ROOM;
      const found = [];
      for (const drawing of [...document.querySelectorAll(`#${view} svg`)].filter(seen)) {
        const names = [...drawing.querySelectorAll('text')].filter(isName).map((e) => e.getBoundingClientRect());
        const title = drawing.id || drawing.getAttribute('aria-label');
        const curves = [...drawing.querySelectorAll('.curve')].filter(seen).length;
        if (curves > names.length) found.push(`${title}: ${curves} curves, ${names.length} names`);
        for (const mark of [...drawing.querySelectorAll('.found, .current, .expected, .start-outline')].filter(seen)) {
          const box = mark.getBoundingClientRect();
          if (!names.some((name) => touches(name, box))) found.push(`${title}: no name at ${mark.outerHTML.slice(0, 90)}`);
        }
        for (const mark of [...drawing.querySelectorAll('.mean')].filter(seen)) {
          const {top, bottom} = mark.getBoundingClientRect();
          if (!names.some((name) => name.top < bottom + ROOM / 2 && top < name.bottom + ROOM / 2)) found.push(`${title}: no name in the row of a mean`);
        }
      }
      return found;
    }""", view)
    assert not unnamed, f"{view}: {unnamed}"
    bare = page.evaluate("""(view) => [...document.querySelectorAll(`#${view} :is(.yes, .no, .doubt)`)]
      .filter((e) => e.checkVisibility() && !/[A-Za-z]{3}/.test(e.textContent)).map((e) => e.outerHTML)""", view)
    assert not bare, f"{view}: told by colour alone: {bare}"


def works_at_twice_the_size(studio, view):
    """At 200 % zoom the page has half the width and height: nothing is too wide, and every control can be brought into sight and is not covered."""
    page = studio.page
    page.set_viewport_size({"width": 640, "height": 450})
    page.wait_for_timeout(300)
    overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    assert overflow <= 0, f"{view} at 200 % is {overflow} px too wide"
    covered = page.evaluate("""(view) => [...document.querySelectorAll(`header a, header button, #${view} :is(button, select, input, summary, [tabindex="0"])`)]
      .filter((e) => e.checkVisibility() && !e.disabled && e.getBoundingClientRect().width > 0)
      .filter((e) => {
        e.scrollIntoView({block: 'center', inline: 'center'});
        const {left, right, top, bottom} = e.getBoundingClientRect();
        const at = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
        // Marks of drawings may lie on each other; they are reached by Tab.
        return !at || !(e.contains(at) || at.contains(e) || (e.closest('svg') && at.closest('svg')));
      }).map((e) => e.outerHTML.slice(0, 120))""", view)
    assert not covered, f"{view} at 200 %: not in reach: {covered}"


def moves_nothing_by_itself(studio):
    """With reduced motion nothing on the page is animated unless a person plays it."""
    page = studio.page
    assert page.evaluate("matchMedia('(prefers-reduced-motion: reduce)').matches")
    for view in KEYS_OF_VIEWS:
        studio.go(view)
        moving = page.evaluate("""() => [...document.querySelectorAll('*')].filter((e) => {
          const {transitionDuration, animationName} = getComputedStyle(e);
          return animationName !== 'none' || transitionDuration.split(',').some((time) => parseFloat(time) > 0);
        }).map((e) => e.outerHTML.slice(0, 80))""")
        assert not moving, f"{view}: moves by itself: {moving}"
        assert page.evaluate("document.getAnimations().length") == 0, view


def takes_pictures(studio, shots):
    page = studio.page
    for view in KEYS_OF_VIEWS:
        studio.go(view)
        for scheme in ("light", "dark"):
            for width, height in ((1280, 900), (800, 1100)):
                page.emulate_media(color_scheme=scheme)
                page.set_viewport_size({"width": width, "height": height})
                page.evaluate("scrollTo(0, 0)")
                page.wait_for_timeout(500)
                overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
                assert overflow <= 0, f"{view} at {width} px is {overflow} px too wide"
                studio.picture(shots / f"{view}-{scheme}-{width}.png")
                is_accessible(studio, f"{view}, {scheme}, {width} px")
        tells_nothing_by_colour_alone(studio, view)
        works_at_twice_the_size(studio, view)
    page.set_viewport_size({"width": 1280, "height": 900})


def project(demo, folder):
    shutil.copytree(demo, folder)
    (folder / "four.scene.toml").write_text(FOUR)
    (folder / "robot.cell.toml").write_text((folder / "cell.toml").read_text() + ROBOT)
    shutil.copy(demo / "pile.mp4", folder.parent / "pile_a_c_e.mp4")


def walk(studio, browser, shots):
    """Every step after the other; the times of the questions whose latency has a bound."""
    opens_once(studio, browser)
    learns_the_properties(studio)
    makes_a_pile(studio)
    makes_a_new_pile(studio)
    draws_walls_and_areas(studio)
    times = drags_the_strike(studio)
    shows_what_the_commands_write(studio)
    plays_the_motion(studio)
    times |= steps_through_films(studio)
    for step in (changes_the_campaign, corrects_a_start, opens_a_clip_from_its_value, says_what_to_film_next, takes_a_pile_from_a_picture,
                 shows_what_others_write, compares_film_and_simulation, moves_a_tag, shows_the_arm, has_a_key_for_every_action, moves_nothing_by_itself):
        begun = time.monotonic()
        step(studio)
        print(f"{step.__name__.replace('_', ' ')}: {time.monotonic() - begun:.1f} s", flush=True)
    takes_pictures(studio, shots)
    assert not studio.problems, studio.problems
    return {"first paint": [studio.paint_ms], **times}


def main(program, demo, shots, is_bounded):
    shots.mkdir(parents=True, exist_ok=True)
    # What is expected may take long on a busy machine; latencies have bounds of their own.
    expect.set_options(timeout=FIT_MS)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        folder = pathlib.Path(folder) / "demo"
        project(demo, folder)
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        begins_in_an_empty_folder(program, demo, browser, shots)
        studio = Studio(program, folder, browser)
        studio.shots = shots
        studio.every, studio.compared = 1 if is_bounded else SOME, 0
        try:
            times = walk(studio, browser, shots)
        except Exception:
            studio.picture(shots / "failed.png")
            raise
        finally:
            studio.close()
            browser.close()
    late = []
    for (what, values), bound in zip(times.items(), (PAINT_MS, MOTION_MS, CLOUD_MS, STEP_MS)):
        p50, p95 = percentile(values, 0.5), percentile(values, 0.95)
        print(f"{what}: p50 {p50:.1f} ms, p95 {p95:.1f} ms of {len(values)}, at most {bound} ms{'' if is_bounded else ' in a release build on idle cores, not checked here'}")
        late += [what] if p95 > bound else []
    print(f"pictures: {shots}")
    assert not (is_bounded and late), f"too late: {', '.join(late)}"


if __name__ == "__main__":
    main(os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve(), "--no-bounds" not in sys.argv[4:])

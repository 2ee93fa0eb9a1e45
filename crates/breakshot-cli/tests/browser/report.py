"""A person plays the motions of `report.html` in headless Chromium, opened as a file.

usage: report.py BREAKSHOT SHOTS

BREAKSHOT is the program, SHOTS the folder for pictures. Every number that is shown is compared with the files of `breakshot demo`.
"""

import bisect
import contextlib
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

from playwright.sync_api import TimeoutError as PlaywrightTimeout
from playwright.sync_api import expect, sync_playwright

CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
# The data are rounded to 0.1 mm in each coordinate of both positions, the text to 0.1 mm.
ROUNDING_MM = math.hypot(0.1, 0.1) + 0.051
CLIP, PLANNED, PILE = 0, 1, 2


def json_of(path):
    return json.loads(path.read_text())


def number(text):
    return float(text.split()[0].replace("\u2212", "-"))


def simulated(trajectory, name, time):
    """The position of an object in trajectory.json (mm)."""
    segments = trajectory["motions"][name]
    k = max(bisect.bisect_right([s["start_s"] for s in segments], time) - 1, 0)
    segment = segments[k]
    if time > segment["end_s"] and k == len(segments) - 1:
        return [1e3 * v for v in trajectory["final"][name][:2]]
    t = min(max(time, segment["start_s"]), segment["end_s"]) - segment["start_s"]
    return [1e3 * sum(c * t**i for i, c in enumerate(segment[axis])) for axis in ("x_m", "y_m")]


class Report:
    """The report, and the files beside it."""

    def __init__(self, folder, browser, **context):
        self.folder = folder
        self.context = browser.new_context(viewport={"width": 1280, "height": 900}, **context)
        self.page = self.context.new_page()
        self.problems, self.requests = [], []
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", lambda m: m.type in ("error", "warning") and self.problems.append(m.text))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(f"file://{folder / 'report.html'}")
        self.tracks = json_of(folder / "tracks/pile.json")
        self.trajectory = json_of(folder / "pile.trajectory.json")
        self.report = json_of(folder / "pile.report.json")
        self.start = self.report["alignment"]["start_s"]
        self.frames = [sample["time_s"] for sample in self.tracks["tracks"][0]["samples"]]

    def player(self, k):
        return self.page.locator(".player").nth(k)

    def time(self, k):
        return float(self.player(k).locator(".timeline").get_attribute("aria-valuenow"))

    def press(self, k, *keys):
        self.player(k).focus()
        for key in keys:
            self.page.keyboard.press(key)

    def distances(self):
        """The distances that are shown, by object (mm)."""
        rows = self.player(PILE).locator(".now tbody tr").all()
        return {row.locator("th").inner_text(): number(row.locator("td").first.inner_text()) for row in rows}

    def agrees_with_the_files(self, frame):
        """The distances at a frame are those of the tracks from the trajectory."""
        shown = self.distances()
        assert set(shown) == {track["object"] for track in self.tracks["tracks"]}, shown
        for track in self.tracks["tracks"]:
            sample = track["samples"][frame]
            filmed = [1e3 * sample["x_m"], 1e3 * sample["y_m"]]
            wanted = math.dist(filmed, simulated(self.trajectory, track["object"], sample["time_s"] - self.start))
            found = shown[track["object"]]
            assert abs(found - wanted) <= ROUNDING_MM, f"{track['object']} in frame {frame}: {found} mm, not {wanted:.2f} mm"


def opens_as_a_file(report):
    """Players stand for the drawings; nothing but the file is loaded; the last instant is shown."""
    assert report.page.locator(".player:visible").count() == 3
    expect(report.page.locator(".still").first).to_be_hidden()
    # Images in the file itself are requests of a browser too.
    outside = [url for url in report.requests if not url.startswith(("file://", "data:"))]
    assert not outside and sum(url.startswith("file://") for url in report.requests) == 1, report.requests
    end = max(self_end for self_end in (report.trajectory["duration_s"], report.frames[-1] - report.start))
    assert abs(report.time(PILE) - end) < 2e-3, (report.time(PILE), end)


def steps_from_frame_to_frame(report):
    """So many steps forth and back; the distances are those of the files in every frame."""
    report.press(PILE, "Home")
    start = report.time(PILE)
    assert abs(start - (report.frames[0] - report.start)) < 1e-3, start
    for frame in range(1, 31):
        report.press(PILE, "ArrowRight")
        assert abs(report.time(PILE) - (report.frames[frame] - report.start)) < 1e-3, frame
        report.agrees_with_the_files(frame)
    report.press(PILE, "PageDown", "PageUp", *["ArrowLeft"] * 30)
    assert report.time(PILE) == start
    report.press(PILE, "PageDown")
    report.agrees_with_the_files(10)
    moved = [max(values) for values in zip(*[report.distances().values()])]
    assert max(moved) < 1, f"{moved} mm before the strike"
    report.press(PILE, "End")
    last = report.distances()
    for entry in report.report["objects"]:
        # The report's poses at rest are means over frames.
        assert abs(last[entry["object"]] - 1e3 * entry["position_error_m"]) < ROUNDING_MM + 0.1, last


def jumps_to_impacts(report):
    """Ctrl and an arrow, and the list of impacts, lead to the times of the trajectory."""
    times = [event["time_s"] for event in report.trajectory["events"]]
    words = [" hits ".join(event["bodies"]) for event in report.trajectory["events"]]
    event = report.player(PILE).locator(".event")
    report.press(PILE, "Home")
    for time, text in zip(times, words):
        report.press(PILE, "Control+ArrowRight")
        assert abs(report.time(PILE) - time) < 1e-3, (report.time(PILE), time)
        expect(event).to_contain_text(text)
    for time in reversed(times[:-1]):
        report.press(PILE, "Control+ArrowLeft")
        assert abs(report.time(PILE) - time) < 1e-3
    buttons = report.player(PILE).locator(".impacts button")
    expect(buttons).to_have_count(len(times))
    buttons.nth(1).press("Enter")
    assert abs(report.time(PILE) - times[1]) < 1e-3
    # Between two frames the film is drawn between them, which is written beside the distance.
    expect(report.player(PILE).locator(".now tbody td.text").first).to_have_text("between two frames")
    expect(report.player(PILE).locator(".impact-mark")).to_have_count(len(times))


def plays_at_its_pace(report):
    """Time passes at the pace, also in the other players, and only in the one with the focus."""
    others = [report.time(CLIP), report.time(PLANNED)]
    report.press(PILE, "Home", *["ArrowUp"] * 3)
    for pace, slower in ((1, 1), (0.5, 1), (0.25, 1), (0.1, 0)):
        report.press(PILE, "Home")
        before = report.time(PILE)
        start = report.page.evaluate("performance.now()")
        report.press(PILE, "Space")
        expect(report.player(PILE).locator(".play")).to_have_text("Pause")
        report.page.wait_for_timeout(500)
        report.press(PILE, "Space")
        passed = (report.page.evaluate("performance.now()") - start) / 1e3
        found = report.time(PILE) - before
        # Keys and pictures take their time.
        assert 0 < found <= pace * passed + 1e-3 and found >= pace * (0.5 - 0.1), f"pace {pace}: {found} s in {passed} s"
        report.press(PILE, *["ArrowDown"] * slower)
    assert [report.time(CLIP), report.time(PLANNED)] == others
    report.press(PLANNED, "Space")
    expect(report.player(PLANNED).locator(".play")).to_have_text("Pause")
    report.press(PLANNED, "Space", "End", "Space")
    report.page.wait_for_timeout(200)
    report.press(PLANNED, "Space")
    assert report.time(PLANNED) < others[1], "from the end it plays from the start"
    scrolled = report.page.evaluate("scrollY")
    report.page.evaluate("document.activeElement.blur()")
    report.page.keyboard.press("Home")
    report.page.wait_for_timeout(300)
    assert report.page.evaluate("scrollY") < scrolled, "without a motion in focus the keys are those of the page"


def compares_side_by_side(report):
    """Film and simulation are drawn over each other or side by side, each named."""
    views = report.player(PILE).locator(".views figure")
    expect(views).to_have_count(1)
    expect(report.player(PILE).locator(".separation")).to_have_count(3)
    report.press(PILE, "b")
    expect(views).to_have_count(2)
    expect(report.player(PILE).locator("figcaption")).to_have_text(["filmed", "simulated"])
    report.press(PILE, "Home", "ArrowRight", "b")
    expect(views).to_have_count(1)
    # In the clip film and fit differ by the noise of the tracks alone.
    report.press(CLIP, "Home", *["ArrowRight"] * 20)
    rows = report.player(CLIP).locator(".now tbody tr").all()
    shown = [number(row.locator("td").first.inner_text()) for row in rows]
    assert len(shown) == 2 and max(shown) < 0.5, shown


def lists_its_keys(report):
    report.page.keyboard.press("?")
    expect(report.page.locator("#keys")).to_be_visible()
    for key in ("Space", "Home", "End", "Page up", "Page down", "Ctrl", "b"):
        expect(report.page.locator("#key-list kbd", has_text=key).first).to_be_visible()
    report.page.keyboard.press("Escape")
    expect(report.page.locator("#keys")).to_be_hidden()


def is_accessible(report, shots):
    """axe-core finds nothing serious in light and dark, wide and narrow; nothing is too wide, also at 200 %."""
    from axe_playwright_python.sync_playwright import Axe

    page = report.page
    report.press(PILE, "Home", "Control+ArrowRight", *["ArrowRight"] * 8)
    for scheme in ("light", "dark"):
        # At 200 % zoom the page has half the width.
        for width in (1280, 800, 640):
            page.emulate_media(color_scheme=scheme)
            page.set_viewport_size({"width": width, "height": 900})
            page.wait_for_timeout(300)
            overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            assert overflow <= 0, f"the report at {width} px is {overflow} px too wide"
            # The picture is for people. Headless Chromium without a GPU sometimes draws none.
            with contextlib.suppress(PlaywrightTimeout):
                report.player(PILE).screenshot(path=str(shots / f"report-{scheme}-{width}.png"), timeout=10_000)
            if width == 1280:
                found = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
                serious = [f"{v['id']}: {[n['html'][:160] for n in v['nodes'][:3]]}" for v in found if v["impact"] in ("serious", "critical")]
                assert not serious, f"{scheme}: {serious}"
    page.set_viewport_size({"width": 1280, "height": 900})


def is_complete_without_scripts(folder, browser):
    report = Report(folder, browser, java_script_enabled=False)
    expect(report.page.locator(".still").first).to_be_visible()
    expect(report.page.locator(".player").first).to_be_hidden()
    expect(report.page.locator("#about-keys")).to_be_hidden()
    report.context.close()


def prints_the_drawings(report):
    report.page.emulate_media(media="print")
    expect(report.page.locator(".still").first).to_be_visible()
    expect(report.page.locator(".player").first).to_be_hidden()
    report.page.emulate_media(media="screen")


def runs_no_other_script(folder, browser):
    """The policy of the page refuses what is not its own script, as a name would be that got out of its place."""
    spoilt = folder / "spoilt.html"
    text = (folder / "report.html").read_text()
    spoilt.write_text(text.replace("<footer>", "<script>document.title = 'taken'</script><img src='x' onerror='document.title = 1' alt=''/><footer>"))
    page = browser.new_page()
    page.goto(f"file://{spoilt}")
    page.wait_for_timeout(200)
    assert page.title().startswith("Breakshot"), page.title()
    assert page.locator(".player:visible").count() == 3
    page.close()
    spoilt.unlink()


def main(program, shots):
    shots.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        folder = pathlib.Path(folder) / "demo"
        made = subprocess.run([program, "demo", "-o", str(folder)], check=False, capture_output=True, text=True)
        assert made.returncode in (0, 3), made.stderr
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        report = Report(folder, browser, reduced_motion="reduce")
        try:
            opens_as_a_file(report)
            steps_from_frame_to_frame(report)
            jumps_to_impacts(report)
            plays_at_its_pace(report)
            compares_side_by_side(report)
            lists_its_keys(report)
            is_accessible(report, shots)
            prints_the_drawings(report)
            assert not report.problems, report.problems
            is_complete_without_scripts(folder, browser)
            runs_no_other_script(folder, browser)
        finally:
            browser.close()
    print("the motions of report.html play, step and compare as its files say")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())

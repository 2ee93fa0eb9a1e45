/** The camera of a cell: where it sees the tags, where the file gives them, and by how much they differ. */

import { byId, fillSelect, fixed, html, mm, prose, showNothing } from "/elements.js";
import { Picture } from "/cell/picture.js";
import { TagList } from "/cell/tags.js";
import { addKeys } from "/keys.js";
import { Newest, ask } from "/server.js";

/** Magnifications of the residuals. */
const TIMES = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
/** The longest residual is drawn at most as long as this part of the picture's width. */
const LONGEST = 0.05;
/** The steps of the arrow keys (m). */
const STEP_M = 1e-4;
const LARGE_STEP_M = 1e-3;
/** Positions are set to whole hundredths of a millimetre. */
const ROUND_M = 1e-5;

export class CellView {
  #message;
  #fit = null;
  /** Tags that are not where the file has them: `{ center_m, yaw_rad }` by number. */
  #edited = new Map();
  #isChosen = false;

  constructor(message) {
    this.#message = message;
    this.asking = new Newest((question) => ask("/api/fit", question), (fit) => this.#show(fit), (error) => this.#failed(error));
    this.picture = new Picture(message, { move: (id, by) => this.moveBy(id, by), select: (id) => this.select(id) });
    this.list = new TagList({ set: (id, change) => this.set(id, change), select: (id) => this.select(id), reset: (id) => this.reset(id) });
    for (const id of ["cell-file", "cell-film"]) byId(id).addEventListener("change", () => this.#open());
    byId("cell-scene").addEventListener("change", () => this.#ask());
    byId("cell-times").addEventListener("change", () => this.#magnify());
    byId("cell-save").addEventListener("click", () => this.save());
    byId("cell-undo").addEventListener("click", () => this.#undo());
    byId("cell-lines").addEventListener("change", () => this.picture.draw());
    this.#addKeys();
  }

  #addKeys() {
    addKeys({ title: "The camera and the tags", view: "cell" }, [
      [["+", "-"], "residuals longer, shorter", (key) => this.#longer(key === "+" ? 1 : -1)],
      [["[", "]"], "the tag before, the next tag", (key) => this.list.other(key === "[" ? -1 : 1)],
      [["l"], "grid, workspace and axes on or off", () => byId("cell-lines").click()],
      [["u"], "all tags as they are in the file", () => this.#undo()],
      [["Ctrl+s"], "write the positions into the cell", () => this.save()],
    ]);
    const isTag = (target) => Boolean(target.closest?.("#cell-overlay .tag"));
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const move = (key, event) => {
      const [x, y] = moves[key.replace("Shift+", "")];
      const step = key.startsWith("Shift+") ? LARGE_STEP_M : STEP_M;
      this.moveBy(Number(event.target.closest(".tag").dataset.tag), [x * step, y * step]);
    };
    addKeys({ title: "A tag with the focus", view: "cell", isFor: isTag }, [
      [Object.keys(moves).flatMap((key) => [key, `Shift+${key}`]), "move it by 0.1 mm on the table, with Shift by 1 mm", move],
      [["Delete"], "back to where the file has it", (_, event) => this.reset(Number(event.target.closest(".tag").dataset.tag))],
    ]);
  }

  async start({ cells, films, scenes }) {
    if (!cells.length || !films.length) {
      showNothing("cell", "This folder holds no cell and film: ", html("code", {}, "breakshot init"), " writes a cell, ", html("code", {}, "breakshot tags"), " prints its tags.");
      return;
    }
    fillSelect(byId("cell-file"), cells.map((name) => [name, name]));
    fillSelect(byId("cell-film"), films.map((name) => [name, name]), films.find((film) => film.startsWith("pile.")));
    fillSelect(byId("cell-scene"), [["", "none"], ...scenes.map((name) => [name, name])]);
    this.#open();
  }

  /** Files were changed: the lists are shown anew, and the fit unless tags are being moved. */
  async refresh(contents) {
    const names = (list) => list.map((name) => [name, name]);
    if (byId("cell").classList.contains("empty")) {
      byId("cell").classList.remove("empty");
      return this.start(contents);
    }
    const { cells, films, scenes } = contents;
    const [cell, film, scene] = ["cell-file", "cell-film", "cell-scene"].map((id) => byId(id).value);
    fillSelect(byId("cell-file"), names(cells), cell);
    fillSelect(byId("cell-film"), names(films), film);
    fillSelect(byId("cell-scene"), [["", "none"], ...names(scenes)], scene);
    if (!this.#edited.size) this.#ask();
    return null;
  }

  #open() {
    this.#edited.clear();
    this.#isChosen = false;
    this.picture.open(byId("cell-film").value);
    this.#ask();
  }

  #ask() {
    const tags = [...this.#edited].map(([id, { center_m, yaw_rad }]) => ({ id, center_m, yaw_rad }));
    this.asking.want({ cell: byId("cell-file").value, film: byId("cell-film").value, scene: byId("cell-scene").value || null, tags });
    const count = tags.length;
    byId("cell-undo").disabled = !count;
    byId("cell-edited").textContent = count ? `${count} ${count === 1 ? "tag is" : "tags are"} not where ${byId("cell-file").value} has ${count === 1 ? "it" : "them"}.` : "";
  }

  #show(fit) {
    this.#fit = fit;
    this.#message.clear();
    this.#isPossible(true);
    // Until a person chooses another, the magnification is that at which the residuals fit beside the tags.
    if (!this.#isChosen) this.#fitMagnification();
    this.list.show(fit, this.#edited);
    this.picture.show(fit, this.#times, this.#edited);
    byId("cell-lengths").textContent = `The grid has ${mm(fit.grid_m, 0)} mm, the axes are ${mm(fit.axis_m, 0)} mm long.`;
    this.#camera(fit);
  }

  /** A fit that is impossible leaves the last one on the page, with the reason. */
  #failed(error) {
    byId("cell-error").textContent = this.#fit ? `${error.message}. Struck numbers are those of the last fit.` : error.message;
    this.#isPossible(false);
  }

  /** Positions with which no camera fits are not saved. */
  #isPossible(isPossible) {
    byId("cell-error").hidden = isPossible;
    byId("cell-save").disabled = !isPossible || !this.#edited.size;
    byId("cell").classList.toggle("stale", !isPossible);
  }

  get #times() {
    return Number(byId("cell-times").value);
  }

  #fitMagnification() {
    const lengths = this.#fit.tags.flatMap(({ residual }) => (residual ? residual.measured_px.map(([x, y], k) => Math.hypot(x - residual.predicted_px[k][0], y - residual.predicted_px[k][1])) : []));
    const room = LONGEST * this.#fit.calibration.camera.size_px[0];
    const times = TIMES.findLast((t) => t * Math.max(...lengths, 1e-6) <= room) ?? TIMES[0];
    fillSelect(byId("cell-times"), TIMES.map((t) => [String(t), `${t} times`]), String(times));
    this.#scale();
  }

  #scale() {
    byId("cell-scale").textContent = `Residuals are drawn ${this.#times} times as long as they are: from where the camera predicts a corner towards where it was measured.`;
  }

  #magnify() {
    this.#isChosen = true;
    this.#scale();
    if (this.#fit) this.picture.show(this.#fit, this.#times, this.#edited);
  }

  #longer(by) {
    if (!this.#fit) return;
    const list = byId("cell-times");
    list.selectedIndex = Math.min(Math.max(list.selectedIndex + by, 0), list.options.length - 1);
    this.#magnify();
  }

  #camera({ calibration, lens, knows_heights: knowsHeights, tag_thickness_m: thickness }) {
    const { camera, position_m: position, tilt_rad: tilt, pixel_size_m: pixel } = calibration;
    byId("cell-rms").textContent = `${fixed(camera.reprojection_rms_m * 1e3, 3)} mm`;
    byId("cell-rms-px").textContent = `error of all tags that are used, ${fixed(camera.reprojection_rms_px, 3)} px`;
    const rows = [];
    if (position) rows.push(["position", `${position.map((v) => fixed(v, 3)).join(", ")} m`]);
    if (tilt != null) rows.push(["optical axis", `${fixed((tilt * 180) / Math.PI, 1)} deg from the vertical`]);
    rows.push(["pixel on the table", `${fixed(pixel * 1e3, 3)} mm`]);
    if (camera.place_std_m != null) rows.push(["worst standard deviation in the workspace", `${mm(camera.place_std_m, 3)} mm`]);
    if (thickness) rows.push(["thickness of the tags", `${mm(thickness)} mm`]);
    if (lens) {
      rows.push(["lens", lens.is_given ? `of the cell, ${lens.model}` : `of the film or fitted, ${lens.model}`]);
      rows.push(["focal length", `${lens.focal_px.map((v) => fixed(v, 1)).join(", ")} px`]);
      rows.push(["principal point", `${lens.center_px.map((v) => fixed(v, 1)).join(", ")} px`]);
      rows.push(["distortion", lens.coefficients.map(([name, value]) => `${name} ${fixed(value, 4)}`).join(", ")]);
    } else rows.push(["lens", "unknown: a homography of the table"]);
    if (!knowsHeights) rows.push(["heights", "unknown without a lens"]);
    byId("cell-camera").replaceChildren(...rows.flatMap(([name, value]) => [html("dt", {}, name), html("dd", {}, value)]));
    const warnings = camera.warnings.map((text) => html("li", {}, html("span", {}, ...prose(text))));
    byId("cell-warnings").replaceChildren(...(warnings.length ? warnings : [html("li", { class: "quiet" }, "none")]));
  }

  /** The tag of this number as it is on the page. */
  #tag(id) {
    return this.#edited.get(id) ?? this.#fit.tags.find((tag) => tag.id === id);
  }

  /** Changes position or yaw of a tag. */
  set(id, change) {
    if (!this.#fit) return;
    const { center_m, yaw_rad } = this.#tag(id);
    const next = { center_m, yaw_rad, ...change };
    next.center_m = next.center_m.map((v) => Number((Math.round(v / ROUND_M) * ROUND_M).toFixed(5)));
    this.#edited.set(id, next);
    // Numbers and outline are moved at once, errors and residuals follow with the fit.
    this.list.move(id, next);
    this.picture.move(id, next);
    this.#ask();
  }

  /** Moves a tag on the table. */
  moveBy(id, [x, y]) {
    if (!this.#fit) return;
    const [u, v] = this.#tag(id).center_m;
    this.set(id, { center_m: [u + x, v + y] });
  }

  /** Takes a tag back to where the file has it. */
  reset(id) {
    if (this.#edited.delete(id)) this.#ask();
  }

  #undo() {
    if (!this.#edited.size) return;
    this.#edited.clear();
    this.#ask();
  }

  select(id) {
    this.list.select(id);
    this.picture.select(id);
  }

  /** Writes the positions into the cell file. */
  async save() {
    if (byId("cell-save").disabled) return;
    const tags = [...this.#edited].map(([id, { center_m, yaw_rad }]) => ({ id, center_m, yaw_rad }));
    const file = await ask("/api/save-tags", { cell: byId("cell-file").value, tags }).catch(this.#message.error);
    if (file == null) return;
    this.#edited.clear();
    this.#ask();
    this.#message.tell(`Wrote ${file}.`);
  }
}

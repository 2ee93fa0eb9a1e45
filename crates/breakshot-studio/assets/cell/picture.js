/** The first frame of a film with the tags, their residuals, and the table's frame drawn on it. Tags are dragged. */

import { byId, svg } from "/elements.js";
import { Frames } from "/films/frames.js";

const points = (line) => line.map(([x, y]) => `${x} ${y}`).join("L");
const open = (line) => (line.length > 1 ? `M${points(line)}` : "");
const closed = (line) => (line.length > 1 ? `M${points(line)}Z` : "");

export class Picture {
  #message;
  #on;
  #frames = new Frames();
  #fit = null;
  #times = 1;
  #edited = new Map();
  #selected = null;
  #drag = null;

  /** `on.move(id, [x, y])` is called when a tag is dragged (m on the table), `on.select(id)` when it is touched. */
  constructor(message, on) {
    this.#message = message;
    this.#on = on;
    const overlay = byId("cell-overlay");
    overlay.addEventListener("pointerdown", (event) => this.#grasp(event));
    overlay.addEventListener("pointermove", (event) => this.#moved(event));
    for (const end of ["pointerup", "pointercancel"]) overlay.addEventListener(end, () => { this.#drag = null; });
  }

  /** Shows the first frame of a film. */
  async open(film) {
    this.#frames.open({ film });
    try {
      const frame = await this.#frames.frame(0);
      const canvas = byId("cell-frame");
      [canvas.width, canvas.height] = [frame.bitmap.width, frame.bitmap.height];
      canvas.getContext("2d", { alpha: false }).drawImage(frame.bitmap, 0, 0);
    } catch (error) {
      this.#message.error(error);
    }
  }

  /** Shows a fit, its residuals so many times as long. */
  show(fit, times, edited) {
    [this.#fit, this.#times, this.#edited] = [fit, times, edited];
    const [width, height] = fit.calibration.camera.size_px;
    byId("cell-overlay").setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    byId("cell-overlay").style.setProperty("--px", `${width / 1000}px`);
    this.draw();
  }

  /** Moves a tag ahead of its fit, through the camera of the fit that is shown. */
  move(id, { center_m: [x, y] }) {
    const tag = this.#fit.tags.find((one) => one.id === id);
    const [[xx, xy], [yx, yy]] = tag.table_per_px_m;
    const [u, v] = [x - tag.center_m[0], y - tag.center_m[1]];
    const det = xx * yy - xy * yx;
    const [right, down] = [(yy * u - xy * v) / det, (xx * v - yx * u) / det];
    if (!Number.isFinite(right + down)) return;
    byId("cell-overlay").querySelector(`[data-tag="${id}"]`)?.setAttribute("transform", `translate(${right.toFixed(2)} ${down.toFixed(2)})`);
  }

  select(id) {
    this.#selected = id;
    for (const tag of byId("cell-overlay").querySelectorAll(".tag")) tag.classList.toggle("selected", Number(tag.dataset.tag) === id);
  }

  draw() {
    if (!this.#fit) return;
    const focused = document.activeElement?.closest?.("#cell-overlay .tag")?.dataset.tag;
    const { objects, points_px: marks } = this.#fit;
    byId("cell-overlay").replaceChildren(
      ...(byId("cell-lines").checked ? this.#lines() : []),
      ...objects.flatMap((object) => this.#object(object)),
      ...this.#fit.tags.map((tag) => this.#tag(tag)),
      ...objects.flatMap((object) => this.#height(object)),
      ...marks.flatMap(([read, predicted]) => [read && this.#cross(read, 6), predicted && svg("circle", { class: "predicted", cx: predicted[0], cy: predicted[1], r: 6 })].filter(Boolean)),
    );
    // A fit that comes while a tag is moved on is older than the position on the page.
    for (const [id, position] of this.#edited) this.move(id, position);
    if (focused != null) byId("cell-overlay").querySelector(`[data-tag="${focused}"]`)?.focus();
  }

  #lines() {
    const { workspace_px: workspace, grid_px: grid, axes_px: axes } = this.#fit;
    return [
      ...grid.map((line) => svg("path", { class: "cell-grid", d: open(line) })),
      ...workspace.map((line) => svg("path", { class: "cell-workspace", d: open(line) })),
      ...axes.flatMap(([name, line]) => (line.length > 1 ? this.#axis(name, line) : [])),
    ];
  }

  #axis(name, line) {
    const [[x, y], [u, v]] = [line[0], line.at(-1)];
    const [dx, dy] = [u - x, v - y];
    return [
      svg("path", { class: "halo-line", d: open(line) }),
      svg("path", { class: `axis ${name}`, d: open(line) }),
      svg("text", { class: "mark-name", x: u + dx * 0.16, y: v + dy * 0.16, "text-anchor": "middle", dy: "0.35em" }, name),
    ];
  }

  /** An object from the table to its height. */
  #object({ base_px: base, top_px: top, center_px: center }) {
    return [
      svg("path", { class: "halo-line", d: closed(top) }), svg("path", { class: "object-base", d: closed(base) }), svg("path", { class: "object-top", d: closed(top) }),
      svg("path", { class: "height", d: open(center) }),
    ];
  }

  /** The name of an object and its height, beside it: those of objects that touch do not lie on each other. */
  #height({ name, height_m: height, top_px: top }) {
    if (!top.length) return [];
    const right = Math.max(...top.map((p) => p[0]));
    const middle = top.reduce((sum, p) => sum + p[1], 0) / top.length;
    return [svg("text", { class: "mark-name", x: right, y: middle, dx: "0.5em", dy: "0.35em" }, `${name}: ${(height * 1e3).toFixed(0)} mm high`)];
  }

  #cross([x, y], arm) {
    return svg("path", { class: "measured", d: `M${x - arm} ${y}H${x + arm}M${x} ${y - arm}V${y + arm}` });
  }

  #tag({ id, outline_px: outline, base_px: base, center_px: center, residual }) {
    const fit = this.#fit.calibration.camera.tags.find((tag) => tag.id === id);
    const state = fit ? (fit.used ? "used" : "left-out") : "unseen";
    const words = fit ? `tag ${id}: ${fit.rms_px.toFixed(3)} px, ${(fit.rms_m * 1e3).toFixed(3)} mm${fit.used ? "" : ", left out"}` : `tag ${id}: not detected`;
    const [x, y] = center ?? [0, 0];
    const low = Math.max(...outline.map((p) => p[1]), y);
    const size = Math.hypot(outline[0]?.[0] - outline[2]?.[0], outline[0]?.[1] - outline[2]?.[1]) || 40;
    const residuals = (residual?.measured_px ?? []).flatMap(([u, v], k) => {
      const [p, q] = residual.predicted_px[k];
      const d = `M${p} ${q}L${(p + (u - p) * this.#times).toFixed(2)} ${(q + (v - q) * this.#times).toFixed(2)}`;
      return [svg("path", { class: "residual-ground", d }), svg("path", { class: "residual", d }), svg("circle", { class: "residual-foot", cx: p, cy: q, r: size / 22 })];
    });
    const width = this.#fit.calibration.camera.size_px[0];
    const anchor = x < width * 0.1 ? "start" : x > width * 0.9 ? "end" : "middle";
    const side = { start: Math.min(...outline.map((p) => p[0]), x), middle: x, end: Math.max(...outline.map((p) => p[0]), x) }[anchor];
    const isAbove = low > this.#fit.calibration.camera.size_px[1] * 0.93;
    const classes = ["tag", state, this.#edited.has(id) ? "edited" : "", this.#selected === id ? "selected" : ""].join(" ");
    return svg("g", { class: classes, "data-tag": id, tabindex: 0, role: "button", "aria-label": `${words}. Arrows move it.`, onfocus: () => this.#on.select(id) },
      ...(this.#fit.tag_thickness_m ? [svg("path", { class: "object-base", d: closed(base) }), ...outline.map((corner, k) => svg("path", { class: "height", d: open([base[k], corner]) }))] : []),
      svg("path", { class: "halo-line", d: closed(outline) }),
      svg("path", { class: "tag-outline", d: closed(outline) }),
      svg("circle", { class: "tag-reach", cx: x, cy: y, r: size * 0.62 }),
      ...residuals,
      svg("text", { class: "mark-name", x: Math.max(side, 4), y: isAbove ? y - size * 0.55 : low, dy: isAbove ? "-0.3em" : "1.25em", "text-anchor": anchor }, words));
  }

  #place(event) {
    const overlay = byId("cell-overlay");
    const box = overlay.getBoundingClientRect();
    const ratio = overlay.viewBox.baseVal.width / box.width;
    return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
  }

  #grasp(event) {
    const tag = event.target.closest?.(".tag");
    if (!tag) return;
    const id = Number(tag.dataset.tag);
    tag.focus();
    byId("cell-overlay").setPointerCapture(event.pointerId);
    // The tag follows the pointer through the camera of the fit that is shown when it is grasped.
    const { table_per_px_m: perPixel } = this.#fit.tags.find((one) => one.id === id);
    this.#drag = { id, at: this.#place(event), perPixel };
  }

  #moved(event) {
    if (!this.#drag) return;
    const { id, at: [x, y], perPixel: [[xx, xy], [yx, yy]] } = this.#drag;
    const [u, v] = this.#place(event);
    const by = [xx * (u - x) + xy * (v - y), yx * (u - x) + yy * (v - y)];
    // Whole tenths of a millimetre; the rest stays for the next movement.
    const whole = by.map((m) => Math.round(m * 1e4) / 1e4);
    if (!whole[0] && !whole[1]) return;
    const det = xx * yy - xy * yx;
    this.#drag.at = [x + (yy * whole[0] - xy * whole[1]) / det, y + (xx * whole[1] - yx * whole[0]) / det];
    this.#on.move(id, whole);
  }
}

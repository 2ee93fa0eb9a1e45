/** The tags as a table: where the file has them, and by how much each is off. Numbers are edited here. */

import { byId, degrees, fixed, html } from "/elements.js";

const DASH = "\u2013";
/** Decimals of positions (mm) and of angles (deg). */
const MM_DECIMALS = 2;
const DEG_DECIMALS = 2;

/** Sets a number unless a person is writing it. */
function put(field, value, decimals) {
  if (document.activeElement !== field) field.value = String(Number(value.toFixed(decimals)));
}

export class TagList {
  #on;
  #rows = new Map();
  #selected = null;

  /** `on.set(id, change)` changes a tag, `on.reset(id)` takes it back, `on.select(id)` selects it. */
  constructor(on) {
    this.#on = on;
  }

  /** Shows a fit; `edited` are the tags that are not where the file has them. */
  show(fit, edited) {
    byId("cell-no-tags").hidden = fit.tags.length > 0;
    const ids = fit.tags.map(({ id }) => id);
    if (ids.join() !== [...this.#rows.keys()].join()) {
      this.#rows = new Map(ids.map((id) => [id, this.#row(id)]));
      byId("cell-tags").tBodies[0].replaceChildren(...[...this.#rows.values()].map(({ row }) => row));
    }
    const worst = this.#worst(fit);
    for (const tag of fit.tags) this.#fill(tag, fit.calibration.camera.tags.find((one) => one.id === tag.id), edited.get(tag.id), tag.id === worst);
    const all = fit.calibration.camera;
    byId("cell-all-px").textContent = fixed(all.reprojection_rms_px, 3);
    byId("cell-all-mm").textContent = fixed(all.reprojection_rms_m * 1e3, 3);
  }

  /** The tag that is farthest off. */
  #worst({ calibration: { camera: { tags } } }) {
    return tags.reduce((worst, tag) => (!worst || tag.rms_m > worst.rms_m ? tag : worst), null)?.id;
  }

  #field(id, label, step, change) {
    const input = html("input", { type: "number", step, "aria-label": `${label} of tag ${id}`, onfocus: () => this.#on.select(id) });
    const set = () => {
      if (input.value !== "" && Number.isFinite(input.valueAsNumber)) this.#on.set(id, change(input.valueAsNumber));
    };
    input.addEventListener("input", set);
    return input;
  }

  #row(id) {
    const tag = { center: [0, 0] };
    const x = this.#field(id, "x in mm", 0.1, (value) => ({ center_m: [value / 1e3, tag.center[1]] }));
    const y = this.#field(id, "y in mm", 0.1, (value) => ({ center_m: [tag.center[0], value / 1e3] }));
    const yaw = this.#field(id, "yaw in degrees", 0.1, (value) => ({ yaw_rad: Number(((value * Math.PI) / 180).toFixed(6)) }));
    const [px, off, dx, dy] = [html("td"), html("td"), html("td"), html("td")];
    const mark = html("td", { class: "text" });
    const reset = html("button", { type: "button", class: "icon plain", "aria-label": `Tag ${id} as it is in the file`, title: "as it is in the file (Delete)", onclick: () => this.#on.reset(id) }, "\u21ba");
    const name = html("button", { type: "button", class: "plain", onclick: () => this.#on.select(id) }, String(id));
    const row = html("tr", {}, html("th", { scope: "row" }, name), html("td", {}, x), html("td", {}, y), html("td", {}, yaw), px, off, dx, dy, mark, html("td", {}, reset));
    return { row, fields: { x, y, yaw }, cells: { px, off, dx, dy, mark }, reset, tag };
  }

  /** Shows a position before the fit to it has come. */
  move(id, { center_m: [x, y], yaw_rad: yaw }) {
    const { fields, tag, reset } = this.#rows.get(id);
    reset.disabled = false;
    tag.center = [x, y];
    put(fields.x, x * 1e3, MM_DECIMALS);
    put(fields.y, y * 1e3, MM_DECIMALS);
    put(fields.yaw, degrees(yaw), DEG_DECIMALS);
  }

  #fill({ id, center_m: center, yaw_rad: yaw, residual }, fit, edited, isWorst) {
    const { row, cells, reset } = this.#rows.get(id);
    this.move(id, edited ?? { center_m: center, yaw_rad: yaw });
    cells.px.textContent = fit ? fixed(fit.rms_px, 3) : DASH;
    cells.off.textContent = fit ? fixed(fit.rms_m * 1e3, 3) : DASH;
    const [dx, dy] = residual ? residual.offset_m : [];
    cells.dx.textContent = residual ? fixed(dx * 1e3, 2) : DASH;
    cells.dy.textContent = residual ? fixed(dy * 1e3, 2) : DASH;
    const words = [fit ? (fit.used ? "" : "left out") : "not detected", isWorst ? "farthest off" : "", edited ? "edited" : ""];
    cells.mark.textContent = words.filter(Boolean).join(", ");
    row.classList.toggle("edited", Boolean(edited));
    reset.disabled = !edited;
  }

  select(id) {
    this.#selected = id;
    for (const [other, { row }] of this.#rows) {
      if (other === id) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    }
  }

  /** Selects the next tag, or the one before. */
  other(by) {
    const ids = [...this.#rows.keys()];
    if (!ids.length) return;
    const k = ids.indexOf(this.#selected);
    const next = ids[(k < 0 ? 0 : k + by + ids.length) % ids.length];
    this.#on.select(next);
    byId("cell-overlay").querySelector(`[data-tag="${next}"]`)?.focus();
  }
}

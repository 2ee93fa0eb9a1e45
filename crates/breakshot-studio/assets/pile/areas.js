/** Walls and keep-out areas: drawn, moved and taken away with the mouse or the keys. */

import { byId, mm, svg } from "/elements.js";
import { addKeys } from "/keys.js";

const STEPS_M = { fine: 0.001, coarse: 0.01 };
/** A wall or area with sides shorter than this is a click, not a drawing (m). */
const LEAST_M = 0.01;
/** Restitution of a wall that is drawn. */
const RESTITUTION = 0.5;
/** Half the sides of what a key puts on the table (m). */
const HALF_M = 0.05;
const WORDS = { walls: "wall", keep_out: "keep-out area" };

const rounded = (point) => point.map((v) => Number(v.toFixed(5)));
const shifted = (points, by) => points.map((p) => rounded([p[0] + by[0], p[1] + by[1]]));

/** The corners of a wall or an area, and the same with other corners. */
const cornersOf = (kind, one) => (kind === "walls" ? [one.from_m, one.to_m] : one.points_m);
const withCorners = (kind, one, points) => (kind === "walls" ? { ...one, from_m: points[0], to_m: points[1] } : { ...one, points_m: points });

/** A wall from one point to another, or the rectangle between them, counter-clockwise. */
function made(kind, [x, y], [u, v]) {
  if (kind === "walls") return { from_m: rounded([x, y]), to_m: rounded([u, v]), restitution: RESTITUTION };
  const [left, right, low, high] = [Math.min(x, u), Math.max(x, u), Math.min(y, v), Math.max(y, v)];
  return { points_m: [[left, low], [right, low], [right, high], [left, high]].map(rounded) };
}

const isLarge = (kind, [x, y], [u, v]) =>
  kind === "walls" ? Math.hypot(u - x, v - y) >= LEAST_M : Math.min(Math.abs(u - x), Math.abs(v - y)) >= LEAST_M;

export class Areas {
  #table;
  #pile;
  #layer = svg("g", { class: "layer-areas" });
  #drawing = null;
  #hold = null;

  /** `pile` has `scene`, `edit()` and `surroundingsChanged()`. */
  constructor(table, pile) {
    this.#table = table;
    this.#pile = pile;
    // Below the objects: what lies on each other is taken from above.
    table.layer("objects").before(this.#layer);
    table.onPointer((event) => this.#drag(event), () => this.#release());
    table.element.addEventListener("pointerdown", (event) => this.#begin(event), { capture: true });
    byId("draw-wall").addEventListener("click", () => this.#arm("walls"));
    byId("draw-keep-out").addEventListener("click", () => this.#arm("keep_out"));
    this.#addKeys();
  }

  /** Draws all walls and areas anew. */
  draw() {
    const focused = document.activeElement?.dataset?.area;
    const groups = ["keep_out", "walls"].flatMap((kind) => this.#pile.scene[kind].map((one, k) => this.#group(kind, one, k)));
    this.#layer.replaceChildren(...groups);
    if (focused) this.#layer.querySelector(`[data-area="${focused}"]`)?.focus({ preventScroll: true });
  }

  #group(kind, one, k) {
    const points = cornersOf(kind, one);
    const [x, y] = points[0];
    const handles = points.map((point, corner) => {
      const [cx, cy] = this.#table.px(point);
      const handle = svg("circle", { class: "corner", cx, cy, r: 6 });
      handle.addEventListener("pointerdown", (event) => this.#take(event, { kind, k, corner }));
      return handle;
    });
    const d = this.#table.line(points) + (kind === "walls" ? "" : "Z");
    const group = svg("g", { class: `area ${kind}`, tabindex: 0, role: "button", "data-area": `${kind} ${k}`,
      "aria-label": `${WORDS[kind]} ${k + 1} at x ${mm(x)}, y ${mm(y)} millimetres` },
      svg("path", { class: "grasp", d }), svg("path", { class: "rim", d }), ...handles);
    group.addEventListener("pointerdown", (event) => this.#take(event, { kind, k, corner: null }));
    return group;
  }

  /** The next drag on the table draws one of this kind; Enter puts one in the middle. */
  #arm(kind) {
    if (!this.#pile.scene) return;
    this.#drawing = this.#drawing?.kind === kind ? null : { kind };
    this.#showArmed();
  }

  #showArmed() {
    const kind = this.#drawing?.kind;
    for (const [id, own] of [["draw-wall", "walls"], ["draw-keep-out", "keep_out"]]) byId(id).setAttribute("aria-pressed", String(kind === own));
    this.#table.element.classList.toggle("drawing", Boolean(kind));
    byId("draw-words").textContent = kind ? `Drag over the table to draw a ${WORDS[kind]}; Enter puts one in the middle, Escape none.` : "";
  }

  #begin(event) {
    if (!this.#drawing || event.button !== 0) return;
    this.#pile.edit();
    this.#drawing.from = this.#table.point(event);
    this.#drawing.preview = svg("path", { class: "preview" });
    this.#layer.append(this.#drawing.preview);
    this.#table.element.setPointerCapture(event.pointerId);
    event.preventDefault();
    event.stopPropagation();
  }

  #take(event, hold) {
    if (event.button !== 0) return;
    this.#pile.edit();
    const one = this.#pile.scene[hold.kind][hold.k];
    this.#hold = { ...hold, from: this.#table.point(event), points: cornersOf(hold.kind, one), pointer: event.pointerId };
    this.#table.element.setPointerCapture(event.pointerId);
    event.currentTarget.closest(".area").focus({ preventScroll: true });
    event.preventDefault();
    event.stopPropagation();
  }

  #drag(event) {
    const to = this.#table.point(event);
    if (this.#drawing?.from) {
      this.#drawing.to = to;
      const one = made(this.#drawing.kind, this.#drawing.from, to);
      this.#drawing.preview.setAttribute("d", this.#table.line(cornersOf(this.#drawing.kind, one)) + (this.#drawing.kind === "walls" ? "" : "Z"));
      return;
    }
    const hold = this.#hold;
    if (!hold || event.pointerId !== hold.pointer) return;
    const by = [to[0] - hold.from[0], to[1] - hold.from[1]];
    const moved = hold.corner === null ? shifted(hold.points, by) : hold.points.map((p, k) => (k === hold.corner ? rounded([p[0] + by[0], p[1] + by[1]]) : p));
    this.#replace(hold.kind, hold.k, moved);
  }

  #release() {
    this.#hold = null;
    if (!this.#drawing?.from) return;
    const { kind, from, to } = this.#drawing;
    this.#drawing = null;
    this.#showArmed();
    if (to && isLarge(kind, from, to)) this.#add(kind, made(kind, from, to));
    else this.draw();
  }

  #add(kind, one) {
    this.#set(kind, [...this.#pile.scene[kind], one]);
    this.#layer.querySelector(`[data-area="${kind} ${this.#pile.scene[kind].length - 1}"]`)?.focus({ preventScroll: true });
  }

  #replace(kind, k, points) {
    this.#set(kind, this.#pile.scene[kind].map((one, other) => (other === k ? withCorners(kind, one, points) : one)));
  }

  #set(kind, list) {
    this.#pile.scene = { ...this.#pile.scene, [kind]: list };
    this.#pile.surroundingsChanged();
  }

  /** The wall or area that has the focus. */
  #focused() {
    const [kind, k] = document.activeElement.dataset.area.split(" ");
    return { kind, k: Number(k), points: cornersOf(kind, this.#pile.scene[kind][Number(k)]) };
  }

  #step(key, by) {
    const { kind, k, points } = this.#focused();
    const step = STEPS_M[key.startsWith("Shift+") ? "coarse" : "fine"];
    this.#pile.edit();
    this.#replace(kind, k, shifted(points, [by[0] * step, by[1] * step]));
  }

  #remove() {
    const { kind, k } = this.#focused();
    this.#pile.edit();
    this.#set(kind, this.#pile.scene[kind].filter((_, other) => other !== k));
    byId(kind === "walls" ? "draw-wall" : "draw-keep-out").focus();
  }

  #addKeys() {
    const isArea = (target) => Boolean(target.dataset?.area);
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    addKeys({ title: "A wall or keep-out area with the focus", view: "pile", isFor: isArea }, [
      [Object.keys(arrows).flatMap((key) => [key, `Shift+${key}`]), "move it by 1 mm, with Shift by 10 mm", (key) => this.#step(key, arrows[key.replace("Shift+", "")])],
      [["Delete", "Backspace"], "take it away", () => this.#remove()],
    ]);
    addKeys({ title: "Walls and keep-out areas", view: "pile" }, [
      [["w"], "draw a wall", () => this.#arm("walls")],
      [["k"], "draw a keep-out area", () => this.#arm("keep_out")],
    ]);
    addKeys({ title: "While one is drawn", view: "pile", isFor: () => Boolean(this.#drawing) }, [
      [["Enter"], "put one in the middle", () => this.#middle()],
      [["Escape"], "draw none", () => this.#arm(this.#drawing.kind)],
    ]);
  }

  #middle() {
    const { min_m: low, max_m: high } = this.#pile.scene.cell.workspace;
    const kind = this.#drawing.kind;
    const [x, y] = [(low[0] + high[0]) / 2, high[1] - 2 * HALF_M];
    this.#arm(kind);
    this.#pile.edit();
    this.#add(kind, made(kind, [x - HALF_M, kind === "walls" ? y : y - HALF_M], [x + HALF_M, kind === "walls" ? y : y + HALF_M]));
  }
}

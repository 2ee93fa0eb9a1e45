/**
 * The strike on the table, with three handles: the striker itself (where it starts), the tip of its path (direction and travel), and the cue
 * behind it (direction about the point of contact, and speed: the farther it is drawn back, the faster).
 */

import { along, degrees, distance, fixed, svg, wrapped } from "/elements.js";
import { addKeys } from "/keys.js";
import { radius } from "/outlines.js";
import { arrowHead } from "/table.js";

/** Distance of the cue's grip behind the striker (px): at no speed, and per speed of the fastest strike. */
const CUE_PX = [26, 90];
const HANDLES = { start: "striker", tip: "end of the strike", cue: "cue" };
/** Decimals to which a strike is rounded, as the planner does. */
const DECIMALS = { start_m: 6, heading_rad: 6, speed_m_s: 4, travel_m: 5 };
const LEAST_TRAVEL_M = 0.002;

const rounded = (value, decimals) => Number(value.toFixed(decimals));

/** A strike with the numbers that are written in files. */
export function written(strike) {
  return {
    ...strike,
    start_m: strike.start_m.map((v) => rounded(v, DECIMALS.start_m)),
    heading_rad: rounded(wrapped(strike.heading_rad), DECIMALS.heading_rad),
    speed_m_s: rounded(strike.speed_m_s, DECIMALS.speed_m_s),
    travel_m: rounded(Math.max(strike.travel_m, LEAST_TRAVEL_M), DECIMALS.travel_m),
  };
}

export class StrikeHandles {
  #table;
  #pile;
  #hold = null;
  #parts = null;

  /** `pile` has `strike`, `setStrike(strike)`, `contact()`, `strikerPose()` and `moved()`. */
  constructor(table, pile) {
    this.#table = table;
    this.#pile = pile;
    table.onPointer((event) => this.#drag(event), () => this.#release());
    this.#addKeys();
  }

  #range() {
    return this.#table.scene.cell.striker.speed_range_m_s;
  }

  /** Draws the strike anew. */
  draw() {
    const layer = this.#table.layer("strike");
    if (!this.#pile.strike) {
      layer.replaceChildren();
      this.#parts = null;
      return;
    }
    if (!this.#parts || this.#parts.scale !== this.#table.scale) this.#build(layer);
    this.update();
  }

  #build(layer) {
    const shape = this.#table.scene.cell.striker.shape;
    const d = this.#table.outline(shape);
    const handle = (name, ...children) => {
      const group = svg("g", { class: `handle ${name}`, tabindex: 0, role: "slider", "data-handle": name, "aria-label": HANDLES[name] }, ...children);
      group.addEventListener("pointerdown", (event) => this.#take(event, name));
      return group;
    };
    const end = svg("path", { class: "striker-end", d });
    const line = svg("path", { class: "strike" });
    const stick = svg("path", { class: "cue-stick" });
    const words = svg("text", { class: "small halo", "text-anchor": "middle" });
    const head = svg("path", { class: "strike-head" });
    const tip = handle("tip", svg("circle", { class: "grasp", r: 14 }), head);
    const start = handle("start", svg("path", { class: "striker", d }));
    const cue = handle("cue", svg("circle", { class: "grasp", r: 14 }), svg("circle", { class: "grip", r: 6.5 }));
    const moving = svg("path", { class: "striker moving", d });
    this.#parts = { end, line, stick, words, head, tip, start, cue, moving, scale: this.#table.scale };
    layer.replaceChildren(stick, end, line, moving, start, tip, cue, words);
  }

  /** Puts the parts of the strike where they are. */
  update() {
    const { strike } = this.#pile;
    const parts = this.#parts;
    if (!strike || !parts) return;
    const { start_m: start, heading_rad: heading, speed_m_s: speed, travel_m: travel } = strike;
    const stop = along(start, heading, travel);
    const [from, to] = [this.#table.px(start), this.#table.px(stop)];
    const behind = radius(this.#table.scene.cell.striker.shape) * this.#table.scale;
    const back = this.#cueLength(speed) + behind;
    const grip = along(from, Math.PI - heading, back);
    parts.start.setAttribute("transform", this.#table.placed([...start, heading]));
    parts.end.setAttribute("transform", this.#table.placed([...stop, heading]));
    parts.line.setAttribute("d", `M${from.join(" ")}L${to.join(" ")}`);
    parts.head.setAttribute("d", arrowHead(to, heading));
    parts.tip.firstChild.setAttribute("cx", to[0]);
    parts.tip.firstChild.setAttribute("cy", to[1]);
    parts.stick.setAttribute("d", `M${along(from, Math.PI - heading, behind + 3).join(" ")}L${grip.join(" ")}`);
    for (const circle of parts.cue.children) {
      circle.setAttribute("cx", grip[0]);
      circle.setAttribute("cy", grip[1]);
    }
    const width = this.#table.element.viewBox.baseVal.width;
    parts.words.setAttribute("x", Math.min(Math.max(grip[0], 30), width - 30));
    parts.words.setAttribute("y", grip[1] + (Math.sin(heading) > 0 ? 24 : -14));
    parts.words.textContent = `${fixed(speed, 2)} m/s`;
    const moving = this.#pile.strikerPose();
    parts.moving.setAttribute("visibility", moving ? "visible" : "hidden");
    if (moving) parts.moving.setAttribute("transform", this.#table.placed(moving));
    this.#tell(parts, strike);
  }

  /** Values for those who hear the page. */
  #tell(parts, { start_m: [x, y], heading_rad, speed_m_s, travel_m }) {
    const heading = `${fixed(degrees(heading_rad))} degrees`;
    const set = (part, now, text) => {
      part.setAttribute("aria-valuenow", now.toFixed(3));
      part.setAttribute("aria-valuetext", text);
    };
    set(parts.start, x * 1e3, `starts at x ${fixed(x * 1e3)}, y ${fixed(y * 1e3)} millimetres`);
    set(parts.tip, travel_m * 1e3, `travel ${fixed(travel_m * 1e3)} millimetres, heading ${heading}`);
    set(parts.cue, speed_m_s, `speed ${fixed(speed_m_s, 2)} metres per second, heading ${heading}`);
  }

  #cueLength(speed) {
    return CUE_PX[0] + (CUE_PX[1] * speed) / this.#range()[1];
  }

  #take(event, name) {
    if (event.button !== 0 || !this.#pile.strike) return;
    this.#pile.edit();
    const [x, y] = this.#table.point(event);
    const { strike } = this.#pile;
    const [sx, sy] = strike.start_m;
    const pivot = this.#pile.contact() ?? strike.start_m;
    this.#hold = { name, pointer: event.pointerId, offset: [sx - x, sy - y], pivot, ahead: distance(strike.start_m, pivot) };
    this.#table.element.setPointerCapture(event.pointerId);
    this.#parts[name].focus({ preventScroll: true });
    event.preventDefault();
    event.stopPropagation();
  }

  #drag(event) {
    const hold = this.#hold;
    if (!hold || event.pointerId !== hold.pointer) return;
    const point = this.#table.point(event);
    const { strike } = this.#pile;
    const changes = {
      start: () => ({ start_m: [point[0] + hold.offset[0], point[1] + hold.offset[1]] }),
      tip: () => ({
        heading_rad: Math.atan2(point[1] - strike.start_m[1], point[0] - strike.start_m[0]),
        travel_m: distance(point, strike.start_m),
      }),
      cue: () => this.#drawn(point, hold),
    };
    this.#pile.setStrike(written({ ...strike, ...changes[hold.name]() }));
  }

  /** The cue drawn to a point: it turns about the contact, and its length is the speed. */
  #drawn(point, { pivot, ahead }) {
    const heading = Math.atan2(pivot[1] - point[1], pivot[0] - point[0]);
    const start = along(pivot, heading + Math.PI, ahead);
    const behind = radius(this.#table.scene.cell.striker.shape);
    const length = (distance(point, pivot) - ahead - behind) * this.#table.scale;
    const [slowest, fastest] = this.#range();
    const speed = ((length - CUE_PX[0]) / CUE_PX[1]) * fastest;
    return { heading_rad: heading, start_m: start, speed_m_s: Math.min(Math.max(speed, slowest), fastest) };
  }

  #release() {
    if (this.#hold) this.#pile.moved();
    this.#hold = null;
  }

  /** Changes the strike by a function of the strike and of a step, coarse with Shift. */
  #change(key, act) {
    if (!this.#pile.strike) return;
    this.#pile.edit();
    const step = key.includes("Shift+") || "<>".includes(key) ? 10 : 1;
    this.#pile.setStrike(written({ ...this.#pile.strike, ...act(this.#pile.strike, step) }));
    this.#pile.moved();
  }

  /** The strike turned about the point of contact. */
  turned(strike, rad) {
    const pivot = this.#pile.contact() ?? strike.start_m;
    const heading = strike.heading_rad + rad;
    const [dx, dy] = [strike.start_m[0] - pivot[0], strike.start_m[1] - pivot[1]];
    const [c, s] = [Math.cos(rad), Math.sin(rad)];
    return { heading_rad: heading, start_m: [pivot[0] + c * dx - s * dy, pivot[1] + s * dx + c * dy] };
  }

  #addKeys() {
    const faster = (strike, by) => {
      const [slowest, fastest] = this.#range();
      return { speed_m_s: Math.min(Math.max(strike.speed_m_s + by, slowest), fastest) };
    };
    const aside = (strike, side) => ({ start_m: along(strike.start_m, strike.heading_rad + Math.PI / 2, side) });
    const longer = (strike, by) => ({ travel_m: strike.travel_m + by });
    addKeys({ title: "The strike", view: "pile" }, [
      [["+", "="], "faster by 0.01 m/s", (key) => this.#change(key, (strike) => faster(strike, 0.01))],
      [["-"], "slower by 0.01 m/s", (key) => this.#change(key, (strike) => faster(strike, -0.01))],
      [["l", "L"], "turn it to the left about the contact by 1\u00b0, with Shift by 10\u00b0", (key) => this.#change(key, (strike) => this.turned(strike, (key === "L" ? 10 : 1) * Math.PI / 180))],
      [["r", "R"], "turn it to the right", (key) => this.#change(key, (strike) => this.turned(strike, (key === "R" ? -10 : -1) * Math.PI / 180))],
      [["u"], "move it to its left by 1 mm", (key) => this.#change(key, (strike) => aside(strike, 0.001))],
      [["d"], "move it to its right by 1 mm", (key) => this.#change(key, (strike) => aside(strike, -0.001))],
      [[".", ">"], "longer travel by 1 mm, with Shift by 10 mm", (key) => this.#change(key, (strike, step) => longer(strike, step * 0.001))],
      [[",", "<"], "shorter travel", (key) => this.#change(key, (strike, step) => longer(strike, -step * 0.001))],
    ]);
    const focused = (title, name) => ({ title: `${title} with the focus`, view: "pile", isFor: (target) => target.dataset?.handle === name });
    const arrows = (act) => [["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"].flatMap((key) => [key, `Shift+${key}`]), act];
    const [all, onStart] = arrows((key) => this.#change(key, (strike, step) => {
      const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key.replace("Shift+", "")];
      return { start_m: [strike.start_m[0] + dx * step * 0.001, strike.start_m[1] + dy * step * 0.001] };
    }));
    addKeys(focused("The striker", "start"), [[all, "move it by 1 mm, with Shift by 10 mm", onStart]]);
    const turnOr = (other) => (key) => this.#change(key, (strike, step) => {
      const name = key.replace("Shift+", "");
      if (name === "ArrowLeft" || name === "ArrowRight") return this.turned(strike, ((name === "ArrowLeft" ? 1 : -1) * step * Math.PI) / 180);
      return other(strike, (name === "ArrowUp" ? 1 : -1) * step);
    });
    addKeys(focused("The cue", "cue"), [[all, "turn it, and change the speed", turnOr((strike, steps) => faster(strike, steps * 0.01))]]);
    addKeys(focused("The end of the strike", "tip"), [[all, "turn it, and change the travel", turnOr((strike, steps) => longer(strike, steps * 0.001))]]);
  }
}

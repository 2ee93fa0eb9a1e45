/** The speed of every joint over time, with the largest one that a path may have. */

import { byId, fixed, svg } from "/elements.js";

const MARGIN = { left: 96, right: 14, top: 20, bottom: 24 };
const ROW_PX = 52;
const GAP_PX = 10;

export class Speeds {
  #element = byId("robot-speeds");
  #path = null;
  #time = 0;

  /** `go(time)` is called when a person points at a time. */
  constructor(go) {
    const point = (event) => {
      const box = this.#element.getBoundingClientRect();
      const x = ((event.clientX - box.left) * this.#width) / box.width;
      go(((x - MARGIN.left) / this.#span) * this.#path.duration_s);
    };
    this.#element.addEventListener("pointerdown", (event) => {
      this.#element.setPointerCapture(event.pointerId);
      point(event);
    });
    this.#element.addEventListener("pointermove", (event) => event.buttons && point(event));
    new ResizeObserver(() => this.#draw()).observe(this.#element);
  }

  /** Shows another path. */
  show(path) {
    this.#path = path;
    this.#draw();
  }

  /** Shows another instant. */
  at(time) {
    this.#time = time;
    this.#element.querySelector(".cursor")?.setAttribute("d", `M${this.#x(time).toFixed(2)} ${MARGIN.top}V${this.#bottom}`);
  }

  get #width() {
    return Math.max(320, this.#element.clientWidth);
  }

  get #span() {
    return this.#width - MARGIN.left - MARGIN.right;
  }

  get #bottom() {
    const count = this.#path.joints.length;
    return MARGIN.top + count * ROW_PX + (count - 1) * GAP_PX;
  }

  #x(time) {
    return MARGIN.left + (time / Math.max(this.#path.duration_s, 1e-9)) * this.#span;
  }

  #draw() {
    if (!this.#path) return;
    const { joints, phases, stroke, duration_s: duration } = this.#path;
    const bottom = this.#bottom;
    this.#element.setAttribute("viewBox", `0 0 ${this.#width} ${bottom + MARGIN.bottom}`);
    const bands = phases.flatMap(({ name, label, span_s: [from, to] }) => {
      const [x, end] = [this.#x(from), this.#x(to)];
      const isWide = end - x > 7 * label.length;
      return [
        svg("rect", { class: `phase ${name}`, x, y: MARGIN.top, width: end - x, height: bottom - MARGIN.top }),
        svg("path", { class: "grid", d: `M${x} ${MARGIN.top}V${bottom}` }),
        ...(isWide ? [svg("text", { class: "small", x: (x + end) / 2, y: 13, "text-anchor": "middle" }, label)] : []),
      ];
    });
    const step = duration > 12 ? 2 : duration > 5 ? 1 : 0.5;
    const axis = Array.from({ length: Math.floor(duration / step) + 1 }, (_, k) => svg("text", { class: "tick", x: this.#x(k * step), y: bottom + 16, "text-anchor": "middle" }, fixed(k * step, step < 1 ? 1 : 0)));
    const contact = svg("path", { class: "mark", d: `M${this.#x(stroke.contact_time_s)} ${MARGIN.top}V${bottom}` });
    const unit = svg("text", { class: "small", x: this.#width - MARGIN.right, y: bottom + 16, "text-anchor": "end" }, "time (s)");
    const rows = joints.flatMap((joint, k) => this.#row(joint, MARGIN.top + k * (ROW_PX + GAP_PX)));
    this.#element.replaceChildren(...bands, ...rows, contact, ...axis.slice(0, -1), unit, svg("path", { class: "cursor" }));
    this.at(this.#time);
  }

  /** One joint: its speed between the limits of both directions. */
  #row({ name, allowed_rad_s: allowed, most_rad_s: most, qd_rad_s: speeds }, top) {
    const middle = top + ROW_PX / 2;
    const y = (speed) => middle - (speed / (allowed * 1.08)) * (ROW_PX / 2);
    const times = this.#path.time_s;
    const curve = `M${speeds.map((speed, k) => `${this.#x(times[k]).toFixed(1)} ${y(speed).toFixed(2)}`).join("L")}`;
    const limits = [allowed, -allowed].map((limit) => svg("path", { class: "bound", d: `M${MARGIN.left} ${y(limit).toFixed(2)}h${this.#span}` }));
    return [
      ...limits, svg("path", { class: "zero", d: `M${MARGIN.left} ${middle}h${this.#span}` }), svg("path", { class: "joint-speed", d: curve }),
      svg("text", { class: "name", x: 4, y: middle - 8 }, name),
      svg("text", { class: "small", x: 4, y: middle + 7 }, `${fixed(most, 2)} of`),
      svg("text", { class: "small", x: 4, y: middle + 21 }, `${fixed(allowed, 2)} rad/s`),
    ];
  }
}

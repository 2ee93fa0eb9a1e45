/** Distance, speed and acceleration of every object over time, on one time axis, with the instant that is shown. */

import { byId, fixed, svg } from "/elements.js";

const MARGIN = { left: 52, right: 14, top: 8, bottom: 24 };
const PANEL_PX = 92;
const GAP_PX = 16;
/** Room for the name of an object. */
const NAME_PX = 22;
const PANELS = [
  { label: "distance (mm)", of: (sample) => sample.distance_m * 1e3 },
  { label: "speed (m/s)", of: (sample) => sample.speed_m_s },
  { label: "acc. (m/s\u00b2)", of: (sample) => sample.acceleration_m_s2 },
];

/** Round numbers from zero to at least `most`. */
function ticks(most, count = 3) {
  const rough = Math.max(most, 1e-9) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
  return Array.from({ length: Math.floor(most / step + 1e-9) + 1 }, (_, k) => k * step);
}

export class Plots {
  #element = byId("plots");
  #motion = null;
  #colour = () => "grey";
  #until = 1;
  #time = 0;

  /** `go(time)` is called when a person points at a time. */
  constructor(go) {
    const point = (event) => {
      const box = this.#element.getBoundingClientRect();
      const x = ((event.clientX - box.left) * this.#width) / box.width;
      go(((x - MARGIN.left) / this.#span) * this.#until);
    };
    this.#element.addEventListener("pointerdown", (event) => {
      this.#element.setPointerCapture(event.pointerId);
      point(event);
    });
    this.#element.addEventListener("pointermove", (event) => event.buttons && point(event));
    new ResizeObserver(() => this.#draw()).observe(this.#element);
  }

  get #width() {
    return Math.max(280, this.#element.clientWidth);
  }

  get #span() {
    return this.#width - MARGIN.left - MARGIN.right;
  }

  /** Shows the motion of a clip; none is shown for one that has not been tracked. */
  show(motion, colour) {
    this.#motion = motion;
    this.#colour = colour;
    const times = (motion?.objects ?? []).flatMap(({ samples }) => samples.map((sample) => sample.time_s));
    this.#until = Math.max(0.01, ...times);
    this.#draw();
  }

  /** Shows another instant. */
  at(time) {
    this.#time = time;
    const x = this.#x(time);
    this.#element.querySelector(".cursor")?.setAttribute("d", `M${x.toFixed(2)} ${MARGIN.top}V${this.#bottom}`);
  }

  get #bottom() {
    return MARGIN.top + PANELS.length * PANEL_PX + (PANELS.length - 1) * GAP_PX;
  }

  #x(time) {
    return MARGIN.left + (time / this.#until) * this.#span;
  }

  #draw() {
    const element = this.#element;
    element.toggleAttribute("hidden", !this.#motion);
    if (!this.#motion) return;
    const height = this.#bottom + MARGIN.bottom;
    element.setAttribute("viewBox", `0 0 ${this.#width} ${height}`);
    const marks = this.#motion.impacts.map(({ time_s }) => svg("path", { class: "mark", d: `M${this.#x(time_s).toFixed(2)} ${MARGIN.top}V${this.#bottom}` }));
    const axis = ticks(this.#until, 6).map((time) => svg("text", { class: "tick", x: this.#x(time), y: this.#bottom + 16, "text-anchor": "middle" }, fixed(time, this.#until < 1 ? 2 : 1)));
    const unit = svg("text", { class: "small", x: this.#width - MARGIN.right, y: this.#bottom + 16, "text-anchor": "end" }, "time (s)");
    element.replaceChildren(...PANELS.flatMap((panel, k) => this.#panel(panel, MARGIN.top + k * (PANEL_PX + GAP_PX))), ...marks, ...axis.slice(0, -1), unit, svg("path", { class: "cursor" }));
    this.at(this.#time);
  }

  #panel({ label, of }, top) {
    const values = this.#motion.objects.flatMap(({ samples }) => samples.map(of).filter((v) => v != null));
    const most = Math.max(1e-6, ...values) * 1.06;
    const y = (value) => top + PANEL_PX - (value / most) * PANEL_PX;
    const lines = ticks(most).flatMap((value) => [
      svg("path", { class: "grid", d: `M${MARGIN.left} ${y(value)}H${MARGIN.left + this.#span}` }),
      svg("text", { class: "tick", x: MARGIN.left - 7, y: y(value) + 4, "text-anchor": "end" }, String(Number(value.toPrecision(3)))),
    ]);
    const curves = this.#motion.objects.map(({ name, samples }) => {
      const points = samples.filter((sample) => of(sample) != null).map((sample) => `${this.#x(sample.time_s).toFixed(2)} ${y(of(sample)).toFixed(2)}`);
      return svg("path", { class: `curve ${this.#colour(name)}`, d: points.length ? `M${points.join("L")}` : "" });
    });
    const title = svg("text", { class: "small", transform: `translate(12 ${top + PANEL_PX / 2}) rotate(-90)`, "text-anchor": "middle" }, label);
    return [...lines, ...curves, ...this.#names(of, top, y), title];
  }

  /** The name of every object at the peak of its curve; names that would lie on each other are set side by side. */
  #names(of, top, y) {
    const taken = [];
    return this.#motion.objects.flatMap(({ name, samples }) => {
      const measured = samples.filter((sample) => of(sample) != null);
      if (!measured.length) return [];
      const peak = measured.reduce((a, b) => (of(b) > of(a) ? b : a));
      const up = Math.max(y(of(peak)) - 4, top + 11);
      let x = Math.min(this.#x(peak.time_s) + 4, MARGIN.left + this.#span - NAME_PX * (taken.length + 1));
      while (taken.some(([u, v]) => Math.abs(u - x) < NAME_PX && Math.abs(v - up) < NAME_PX)) x += NAME_PX;
      taken.push([x, up]);
      return [svg("text", { class: "name halo", x, y: up }, name)];
    });
  }
}

/** The distance of one pair over time, filmed and simulated; the other pairs are faint behind it. */

import { byId, distance, fixed, svg } from "/elements.js";
import { pose } from "/motion.js";

const MARGIN = { left: 52, right: 14, top: 18, bottom: 24 };
const HEIGHT_PX = 190;
/** Instants of a simulated curve beside those of the impacts. */
const INSTANTS = 240;
/** More pairs are not drawn behind the one that is selected. */
const MOST_BEHIND = 30;

/** Round numbers from `low` to `high`. */
function ticks(low, high, count) {
  const rough = Math.max(high - low, 1e-9) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

export class Distances {
  #element = byId("compare-distances");
  #shown = null;
  #axis = null;
  #pair = null;
  #time = 0;

  /** `go(time)` is called when a person points at a time. */
  constructor(go) {
    const point = (event) => {
      const box = this.#element.getBoundingClientRect();
      const x = ((event.clientX - box.left) * this.#width) / box.width;
      go(this.#axis.start + ((x - MARGIN.left) / this.#span) * (this.#axis.end - this.#axis.start));
    };
    this.#element.addEventListener("pointerdown", (event) => {
      this.#element.setPointerCapture(event.pointerId);
      point(event);
    });
    this.#element.addEventListener("pointermove", (event) => event.buttons && point(event));
    new ResizeObserver(() => this.#draw()).observe(this.#element);
  }

  /** Shows another comparison, on the time axis of its playback. */
  show(shown, { start, end, moments }) {
    this.#shown = shown;
    this.#axis = { start, end, moments };
    this.#draw();
  }

  /** Shows this pair before the others. */
  select(pair) {
    this.#pair = pair;
    this.#draw();
  }

  /** Shows another instant. */
  at(time) {
    this.#time = time;
    this.#element.querySelector(".cursor")?.setAttribute("d", `M${this.#x(time).toFixed(2)} ${MARGIN.top}V${HEIGHT_PX - MARGIN.bottom}`);
  }

  get #width() {
    return Math.max(280, this.#element.clientWidth);
  }

  get #span() {
    return this.#width - MARGIN.left - MARGIN.right;
  }

  #x(time) {
    const { start, end } = this.#axis;
    return MARGIN.left + ((time - start) / Math.max(end - start, 1e-9)) * this.#span;
  }

  /** `[time, mm]` of a pair in the frames that show both. */
  #filmed({ a, b }) {
    const [one, other] = [a, b].map((name) => this.#shown.objects.find((object) => object.name === name)?.samples ?? []);
    return this.#shown.frames_s.flatMap((time, k) => (one[k] && other[k] ? [[time, distance(one[k].position_m, other[k].position_m) * 1e3]] : []));
  }

  #simulated({ a, b }) {
    const { start, end, moments } = this.#axis;
    const steps = Array.from({ length: INSTANTS + 1 }, (_, k) => start + ((end - start) * k) / INSTANTS);
    const times = [...steps, ...moments.map(({ time }) => time)].sort((one, other) => one - other);
    return times.flatMap((time) => {
      const [one, other] = [a, b].map((name) => pose(this.#shown.trajectory, name, Math.max(0, time)));
      return one && other ? [[time, distance(one, other) * 1e3]] : [];
    });
  }

  #draw() {
    this.#element.toggleAttribute("hidden", !this.#pair);
    if (!this.#shown || !this.#pair) return;
    const pairs = this.#shown.report.pairs;
    const behind = pairs.length <= MOST_BEHIND ? pairs.filter((pair) => pair !== this.#pair) : [];
    const curves = [...behind, this.#pair].map((pair) => ({ pair, filmed: this.#filmed(pair), simulated: this.#simulated(pair) }));
    const values = curves.flatMap(({ filmed, simulated }) => [...filmed, ...simulated].map(([, mm]) => mm));
    const most = Math.max(1, ...values) * 1.05;
    const low = HEIGHT_PX - MARGIN.bottom;
    const y = (mm) => low - (mm / most) * (low - MARGIN.top);
    const line = (points) => (points.length ? `M${points.map(([time, mm]) => `${this.#x(time).toFixed(2)} ${y(mm).toFixed(2)}`).join("L")}` : "");
    this.#element.setAttribute("viewBox", `0 0 ${this.#width} ${HEIGHT_PX}`);
    const { start, end } = this.#axis;
    const axis = ticks(start, end, 7).map((time) => svg("text", { class: "tick", x: this.#x(time), y: low + 16, "text-anchor": "middle" }, fixed(time, end - start < 1 ? 2 : 1)));
    const rows = ticks(0, most, 4).flatMap((mm) => [
      svg("path", { class: "grid", d: `M${MARGIN.left} ${y(mm)}H${MARGIN.left + this.#span}` }),
      svg("text", { class: "tick", x: MARGIN.left - 7, y: y(mm) + 4, "text-anchor": "end" }, String(mm)),
    ]);
    const marks = this.#axis.moments.map(({ time }) => svg("path", { class: "mark", d: `M${this.#x(time).toFixed(2)} ${MARGIN.top}V${low}` }));
    const drawn = curves.flatMap(({ pair, filmed, simulated }) => {
      const kind = pair === this.#pair ? "selected" : "behind";
      return [svg("path", { class: `distance filmed-distance ${kind}`, d: line(filmed) }), svg("path", { class: `distance simulated-distance ${kind}`, d: line(simulated) })];
    });
    const title = svg("text", { class: "small", transform: `translate(12 ${(low + MARGIN.top) / 2}) rotate(-90)`, "text-anchor": "middle" }, "distance (mm)");
    const unit = svg("text", { class: "small", x: this.#width - MARGIN.right, y: low + 16, "text-anchor": "end" }, "time (s)");
    const key = svg("text", { class: "name", x: MARGIN.left + 6, y: 12 }, `${this.#pair.a} \u2013 ${this.#pair.b}: `, svg("tspan", { class: "small" }, "solid filmed, dashed simulated"));
    this.#element.replaceChildren(...rows, ...marks, ...drawn, ...axis.slice(0, -1), unit, title, key, svg("path", { class: "cursor" }));
    this.at(this.#time);
  }
}

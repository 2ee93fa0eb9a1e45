/** The time of a playback as a line with a knob and a mark for each impact. */

import { fixed, svg } from "/elements.js";

const HEIGHT_PX = 30;
/** Room at both ends for the knob (px). */
const END_PX = 8;

export class Timeline {
  #line;
  #playback;
  #knob = null;

  /** `line` is an `svg` with the role of a slider. */
  constructor(line, playback) {
    this.#line = line;
    this.#playback = playback;
    line.addEventListener("pointerdown", (event) => {
      line.setPointerCapture(event.pointerId);
      this.#scrub(event);
    });
    line.addEventListener("pointermove", (event) => event.buttons && this.#scrub(event));
    new ResizeObserver(() => this.draw()).observe(line);
  }

  #scrub(event) {
    const box = this.#line.getBoundingClientRect();
    const { start, end } = this.#playback;
    const part = (event.clientX - box.left - END_PX) / Math.max(1, box.width - 2 * END_PX);
    this.#playback.stopAt(start + part * (end - start));
  }

  get #width() {
    return Math.max(80, this.#line.clientWidth);
  }

  #x(time) {
    const { start, end } = this.#playback;
    const part = end > start ? (time - start) / (end - start) : 0;
    return (END_PX + part * (this.#width - 2 * END_PX)).toFixed(2);
  }

  /** Draws the line and the impacts. */
  draw() {
    const line = this.#line;
    const { start, end, moments } = this.#playback;
    line.setAttribute("viewBox", `0 0 ${this.#width} ${HEIGHT_PX}`);
    const marks = moments.map(({ time, words }) =>
      svg("path", { class: "impact-mark", d: `M${this.#x(time)} 6V${HEIGHT_PX - 6}` },
        svg("title", {}, `${fixed(time * 1e3, 1)} ms: ${words.join(", ")}`)));
    this.#knob = svg("circle", { class: "time-knob", cy: HEIGHT_PX / 2, r: 6.5 });
    line.replaceChildren(svg("path", { class: "time-line", d: `M${END_PX} ${HEIGHT_PX / 2}H${this.#width - END_PX}` }), ...marks, this.#knob);
    line.setAttribute("aria-valuemin", start.toFixed(3));
    line.setAttribute("aria-valuemax", end.toFixed(3));
    this.update();
  }

  /** Puts the knob at the time that is shown. */
  update() {
    const { time, moments, lastImpact } = this.#playback;
    this.#knob?.setAttribute("cx", this.#x(time));
    this.#line.setAttribute("aria-valuenow", time.toFixed(3));
    const after = lastImpact ? `, impact ${lastImpact.number} of ${moments.length}: ${lastImpact.words}` : "";
    this.#line.setAttribute("aria-valuetext", `${fixed(time, 3)} seconds${after}`);
  }
}

/** Plays a simulated motion: at a pace, step by step, from impact to impact. */

import { byId, fixed, html, svg } from "/elements.js";
import { addKeys } from "/keys.js";
import { moments } from "/motion.js";

/** One step: a frame of a film at sixty pictures a second. */
const STEP_S = 1 / 60;
const LARGE_STEP_S = 10 * STEP_S;
const HEIGHT_PX = 30;

export class Player {
  #changed;
  #trajectory = null;
  #moments = [];
  #playing = null;
  #last = 0;
  #time = 0;

  /** `changed(time)` is called whenever another instant is shown. */
  constructor(changed) {
    this.#changed = changed;
    byId("play").addEventListener("click", () => this.toggle());
    byId("back").addEventListener("click", () => this.step(-STEP_S));
    byId("forth").addEventListener("click", () => this.step(STEP_S));
    const line = byId("timeline");
    line.addEventListener("pointerdown", (event) => {
      line.setPointerCapture(event.pointerId);
      this.#scrub(event);
    });
    line.addEventListener("pointermove", (event) => event.buttons && this.#scrub(event));
    new ResizeObserver(() => this.#draw()).observe(line);
    this.#addKeys();
  }

  get time() {
    return this.#time;
  }

  get isPlaying() {
    return this.#playing !== null;
  }

  get duration() {
    return this.#trajectory?.duration_s ?? 0;
  }

  /** Shows another motion; its time is kept as far as it lasts. */
  show(trajectory) {
    this.#trajectory = trajectory;
    this.#moments = trajectory ? moments(trajectory) : [];
    this.#draw();
    this.go(trajectory ? Math.min(this.#time, this.duration) : 0);
  }

  /** Goes to a time. */
  go(time) {
    this.#time = Math.min(Math.max(time, 0), this.duration);
    this.#tell();
    this.#changed(this.#time);
  }

  step(by) {
    this.pause();
    this.go(this.#time + by);
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  play() {
    if (!this.#trajectory) return;
    if (this.#time >= this.duration - 1e-9) this.go(0);
    this.#last = performance.now();
    const frame = (now) => {
      const pace = Number(byId("pace").value);
      this.go(this.#time + (pace * Math.max(0, now - this.#last)) / 1e3);
      this.#last = now;
      if (this.#time >= this.duration - 1e-9) this.pause();
      else this.#playing = requestAnimationFrame(frame);
    };
    this.#playing = requestAnimationFrame(frame);
    this.#button();
  }

  pause() {
    cancelAnimationFrame(this.#playing);
    this.#playing = null;
    this.#button();
  }

  /** Goes to the next impact, or back to the one before. */
  impact(direction) {
    this.pause();
    const times = this.#moments.map((moment) => moment.time);
    const next = direction > 0
      ? times.find((time) => time > this.#time + 1e-9) ?? this.duration
      : times.findLast((time) => time < this.#time - 1e-9) ?? 0;
    this.go(next);
  }

  #button() {
    const button = byId("play");
    button.textContent = this.isPlaying ? "Pause" : "Play";
    button.setAttribute("aria-label", button.textContent);
  }

  #scrub(event) {
    const box = byId("timeline").getBoundingClientRect();
    this.pause();
    this.go(((event.clientX - box.left - 8) / Math.max(1, box.width - 16)) * this.duration);
  }

  #x(time, width) {
    return 8 + (this.duration ? time / this.duration : 0) * (width - 16);
  }

  #draw() {
    const line = byId("timeline");
    const width = Math.max(80, line.clientWidth);
    line.setAttribute("viewBox", `0 0 ${width} ${HEIGHT_PX}`);
    const marks = this.#moments.map(({ time, words }) =>
      svg("path", { class: "impact-mark", d: `M${this.#x(time, width).toFixed(2)} 6V${HEIGHT_PX - 6}` },
        svg("title", {}, `${fixed(time * 1e3, 1)} ms: ${words.join(", ")}`)));
    line.replaceChildren(
      svg("path", { class: "time-line", d: `M8 ${HEIGHT_PX / 2}H${width - 8}` }), ...marks,
      svg("circle", { class: "time-knob", cy: HEIGHT_PX / 2, r: 6.5 }));
    line.setAttribute("aria-valuemax", fixed(this.duration, 3));
    this.#tell();
  }

  #tell() {
    const line = byId("timeline");
    const width = Math.max(80, line.clientWidth);
    line.querySelector(".time-knob")?.setAttribute("cx", this.#x(this.#time, width));
    line.setAttribute("aria-valuenow", this.#time.toFixed(3));
    const now = this.#moments.findLast((moment) => moment.time <= this.#time + 1e-9);
    const at = now && this.#time - now.time < STEP_S / 2;
    byId("time").textContent = `${fixed(this.#time, 3)} s`;
    const number = now ? this.#moments.indexOf(now) + 1 : 0;
    const words = now ? `${number} of ${this.#moments.length}: ${now.words.join(", ")}` : "";
    byId("event").replaceChildren(...(this.#trajectory ? [
      html("span", { class: at ? "now" : "" }, now ? `impact ${words}` : `${this.#moments.length} impacts`),
    ] : []));
  }

  #addKeys() {
    addKeys({ title: "The motion", view: "pile" }, [
      [["Space"], "play or pause", () => this.toggle()],
      [["ArrowLeft"], "one step back", () => this.step(-STEP_S)],
      [["ArrowRight"], "one step forth", () => this.step(STEP_S)],
      [["PageUp"], "ten steps back", () => this.step(-LARGE_STEP_S)],
      [["PageDown"], "ten steps forth", () => this.step(LARGE_STEP_S)],
      [["Ctrl+ArrowLeft"], "to the impact before", () => this.impact(-1)],
      [["Ctrl+ArrowRight"], "to the next impact", () => this.impact(1)],
      [["Home"], "to the start", () => this.step(-Infinity)],
      [["End"], "to the end", () => this.step(Infinity)],
      [["ArrowUp"], "faster", () => this.#pace(-1)],
      [["ArrowDown"], "slower", () => this.#pace(1)],
    ]);
  }

  #pace(by) {
    const pace = byId("pace");
    pace.selectedIndex = Math.min(Math.max(pace.selectedIndex + by, 0), pace.options.length - 1);
  }
}

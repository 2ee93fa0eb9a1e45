/** What a comparison found: goal, distances of all pairs, and what the difference may come from. */

import { byId, distance, fixed, html, mm, prose } from "/elements.js";
import { pose } from "/motion.js";

const signed = (metres) => (metres >= 0 ? "+" : "") + mm(metres);
const DASH = "\u2013";

export class Findings {
  #on;
  #shown = null;
  #rows = [];
  #index = 0;

  /** `on.go(time)` is called for an instant that a person wants, `on.pair(pair)` for a pair. */
  constructor(on) {
    this.#on = on;
  }

  /** The number of the pair with the largest difference. */
  get largest() {
    const sizes = this.#shown.report.pairs.map(({ difference_m: d }) => Math.abs(d));
    return Math.max(0, sizes.indexOf(Math.max(...sizes)));
  }

  /** Shows a comparison. */
  show(shown, colour) {
    this.#shown = shown;
    const { report } = shown;
    this.#conclusion(report);
    this.#pairs(report);
    this.#objects(report, colour);
    this.#reasons(shown);
    const warnings = report.warnings.map((text) => html("li", {}, html("span", {}, ...prose(text))));
    byId("compare-warnings").replaceChildren(...(warnings.length ? warnings : [html("li", { class: "quiet" }, "none")]));
  }

  #conclusion({ goal, summary, alignment }) {
    const line = (place, { fulfilled, min_distance_m: least, mean_distance_m: mean, violations }) => {
      const distances = least == null ? "" : `least distance ${mm(least)} mm, mean ${mm(mean)} mm`;
      return html("li", {}, html("b", { class: fulfilled ? "yes" : "no" }, fulfilled ? "goal reached" : "goal not reached"), ` in the ${place}: ${violations[0] ?? distances}`);
    };
    byId("compare-goal").replaceChildren(line("film", goal.observed), line("simulation", goal.predicted));
    const { all } = summary;
    byId("compare-mean").textContent = all ? `${mm(all.mean_m)} mm` : DASH;
    byId("compare-worst").textContent = all ? `mean difference of a distance at rest; the largest is ${mm(all.worst_m)} mm` : "there is one object: no distances";
    byId("compare-aligned").textContent = alignment
      ? `Times count from the start of the striker, ${fixed(alignment.start_s, 3)} s into the film: there ${alignment.object} has first moved by as much in film and simulation.`
      : "The struck object does not move in both: film and simulation begin at their own starts, and the outlines of an instant do not belong together.";
  }

  #pairs({ pairs }) {
    byId("compare-pairs-section").hidden = !pairs.length;
    this.#rows = pairs.map((pair, k) => {
      const select = html("button", { type: "button", class: "plain", onclick: () => this.select(k) }, `${pair.a} \u2013 ${pair.b}`);
      const cell = (text) => html("td", {}, text);
      return html("tr", {}, html("th", { scope: "row" }, select), cell(DASH), cell(DASH), cell(mm(pair.observed_m)), cell(mm(pair.predicted_m)), cell(signed(pair.difference_m)));
    });
    byId("compare-pairs").tBodies[0].replaceChildren(...this.#rows);
  }

  #objects({ objects }, colour) {
    const row = ({ object, placement_error_m: before, observed_way_m: filmed, predicted_way_m: simulated, position_error_m: error, yaw_error_rad: yaw }) =>
      html("tr", {}, html("th", { scope: "row" }, html("span", { class: `swatch ${colour(object)}` }), object),
        ...[mm(before), mm(filmed), mm(simulated), mm(error), yaw == null ? DASH : fixed((yaw * 180) / Math.PI, 1)].map((text) => html("td", {}, text)));
    byId("compare-objects").tBodies[0].replaceChildren(...objects.map(row));
  }

  #reasons({ reasons, report, divergence_m: least }) {
    byId("compare-rule").textContent = report.alignment
      ? `An object leaves its simulated motion where it is more than ${mm(least)} mm from it and stays so. The earliest comes first: what happens later may follow from it.`
      : "";
    byId("compare-reasons").replaceChildren(...reasons.map(({ text, time_s: time }) => {
      const go = () => this.#on.go(time);
      return html("li", {}, time == null ? html("span", {}, text) : html("button", { type: "button", title: "shows this instant", onclick: go }, text));
    }));
  }

  /** Selects a pair by its number. */
  select(k) {
    const { pairs } = this.#shown.report;
    if (!pairs.length) return this.#on.pair(null);
    this.#index = (k + pairs.length) % pairs.length;
    this.#rows.forEach((row, i) => (i === this.#index ? row.setAttribute("aria-current", "true") : row.removeAttribute("aria-current")));
    return this.#on.pair(pairs[this.#index]);
  }

  /** Selects the next pair, or the one before. */
  other(by) {
    if (this.#shown) this.select(this.#index + by);
  }

  /** Shows the distances in a frame; none after the film. */
  at(number, hasFrame) {
    const { report, objects, trajectory } = this.#shown;
    const shots = new Map(objects.map(({ name, samples }) => [name, hasFrame ? samples[number] : null]));
    report.pairs.forEach(({ a, b }, k) => {
      const [one, other] = [shots.get(a), shots.get(b)];
      const cells = this.#rows[k].cells;
      cells[1].textContent = one && other ? mm(distance(one.position_m, other.position_m)) : DASH;
      const [p, q] = [[a, one], [b, other]].map(([name, shot]) => shot && report.alignment && pose(trajectory, name, shot.time_s));
      cells[2].textContent = p && q ? mm(distance(p, q)) : DASH;
    });
  }
}

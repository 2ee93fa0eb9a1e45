/** What is expected of the strike, in numbers and words. */

import { byId, fixed, html, mm, svg } from "/elements.js";

const BAR = { width: 240, height: 14 };
/** Half of the interval that contains the probability in 95 of 100 cases, in standard errors. */
const HALF_95 = 1.96;

const percent = (part) => `${fixed(part * 100)}\u00a0%`;

/** Shows the nominal motion or the cloud, whichever is given. */
export function showForecast({ motion, outlook }) {
  byId("forecast").classList.remove("impossible");
  if (motion) showVerdict(motion);
  if (outlook !== undefined) showProbability(outlook);
}

/** Shows why there is no forecast. */
export function showProblem(reason) {
  byId("forecast").classList.add("impossible");
  byId("verdict").textContent = reason;
  showProbability(null);
}

function showVerdict({ min_distance_m, mean_distance_m, violations }) {
  const isFulfilled = violations.length === 0;
  const distances = min_distance_m == null ? "" : ` Centres at least ${mm(min_distance_m)} mm apart, ${mm(mean_distance_m)} mm on average.`;
  byId("verdict").replaceChildren(
    html("strong", { class: isFulfilled ? "yes" : "no" }, isFulfilled ? "\u2713 Nominal motion reaches the goal." : "\u2717 Nominal motion misses the goal"),
    isFulfilled ? distances : `: ${violations[0]}.`);
}

function showProbability(outlook) {
  const probability = outlook?.success_probability;
  byId("probability").textContent = outlook ? percent(probability) : "\u2013";
  byId("probability-words").textContent = outlook ? `success in ${outlook.samples} worlds, \u00b1\u00a0${fixed(HALF_95 * 100 * outlook.standard_error)}\u00a0%` : "";
  const bar = byId("probability-bar");
  bar.setAttribute("viewBox", `0 0 ${BAR.width} ${BAR.height}`);
  bar.setAttribute("aria-label", outlook ? `Success probability ${percent(probability)}` : "No success probability");
  const x = (part) => Math.min(Math.max(part, 0), 1) * (BAR.width - 2) + 1;
  const ground = svg("rect", { class: "bar-ground", x: 0, y: 4, width: BAR.width, height: 6, rx: 3 });
  if (!outlook) return bar.replaceChildren(ground);
  const [low, high] = [-1, 1].map((side) => x(probability + side * HALF_95 * outlook.standard_error));
  bar.replaceChildren(ground,
    svg("rect", { class: "bar-filled", x: 0, y: 4, width: x(probability), height: 6, rx: 3 }),
    svg("path", { class: "bar-interval", d: `M${low} 2V12M${low} 7H${high}M${high} 2V12` }));
  const failures = outlook.failures.slice(0, 4);
  byId("failures").replaceChildren(...failures.map(({ what, part }) => html("li", {}, html("span", { class: "part" }, percent(part)), ` ${what}`)));
  return null;
}

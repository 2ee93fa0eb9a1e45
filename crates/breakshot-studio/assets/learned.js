/** What the films have taught: every property with its interval, and one mark for each clip. */

import { byId, fillSelect, fixed, html, prose, showNothing, svg } from "/elements.js";
import { addKeys } from "/keys.js";
import { ask, askForJob, follow, read } from "/server.js";
import { kindOf } from "/table.js";

/** Key of the property, key of its clips' values, title, unit. */
const GROUPS = [
  ["friction", "friction", "Friction on the table"],
  ["striker_restitution", "striker_restitution", "Restitution between striker and object"],
  ["restitution", "restitution", "Restitution between objects"],
  ["pair_mass_ratio", "pair_mass_ratio", "Mass ratios of pairs"],
  ["mass_ratio", null, "Mass over that of the reference object"],
];
const ROW_PX = 34;
const LEFT_PX = 56;
const RIGHT_PX = 170;
const FOOT_PX = 24;

/** Round numbers between two values. */
function ticks(low, high) {
  const rough = (high - low) / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
  const decimals = Math.max(0, -Math.floor(Math.log10(step)));
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, k) => [(first + k) * step, decimals]);
}

/** The warnings of each cause under its summary; those of files without causes as one list. */
function warningsByCause({ warnings, causes = [] }) {
  const list = (lines) => html("ul", { class: "warnings" }, ...lines.map((line) => html("li", {}, ...prose(line))));
  if (!causes.length) return warnings.length ? [list(warnings)] : [];
  let first = 0;
  return causes.map((group) => {
    const lines = warnings.slice(first, (first += group.warnings));
    return html("section", {}, html("h3", {}, ...prose(group.summary)), list(lines));
  });
}

export class Learned {
  #message;
  #open;
  #shown = null;
  #contents = null;
  /** The properties that stood in the file before the last estimate. */
  #before = null;
  #job = null;

  /** `open(clip, bodies)` opens a clip at the impact of these bodies. */
  constructor(message, open) {
    this.#message = message;
    this.#open = open;
    byId("learned-file").addEventListener("change", (event) => {
      this.#before = null;
      this.#read(event.target.value).catch(message.error);
    });
    byId("learn").addEventListener("click", () => this.estimate());
    byId("advise").addEventListener("click", () => this.advise());
    byId("stop-learning").addEventListener("click", () => this.cancel());
    addKeys({ title: "The properties", view: "learned" }, [
      [["e"], "estimate them from the films of the campaign", () => this.estimate()],
      [["n"], "what to film next", () => this.advise()],
      [["Escape"], "cancel the estimate", () => this.cancel()],
    ]);
    new ResizeObserver(() => this.#shown && this.#draw()).observe(byId("learned-charts"));
  }

  async start(contents) {
    this.#contents = contents;
    const { properties, campaigns } = contents;
    fillSelect(byId("learned-campaign"), campaigns.map((name) => [name, name]));
    byId("learn").disabled = !campaigns.length;
    this.#showFiles(properties[0]);
    if (properties.length) await this.#read(properties[0]);
    else if (!campaigns.length) showNothing("learned", "This folder holds no properties, and no campaign to learn them from.");
    else this.#message.tell("This folder holds no properties yet: Estimate learns them from the films of a campaign.");
  }

  /** Files were changed: the lists are shown anew, and the properties if they are other ones. */
  async refresh({ properties, campaigns }) {
    const [campaign, file] = [byId("learned-campaign").value, byId("learned-file").value];
    byId("learned").classList.toggle("empty", !properties.length && !campaigns.length);
    fillSelect(byId("learned-campaign"), campaigns.map((name) => [name, name]), campaigns.includes(campaign) ? campaign : undefined);
    byId("learn").disabled = this.#job !== null || !campaigns.length;
    this.#showFiles(properties.includes(file) ? file : properties[0]);
    const shown = byId("learned-file").value;
    if (!shown || this.#job !== null) return;
    const found = await read("/api/properties", { file: shown });
    if (JSON.stringify(found) !== JSON.stringify(this.#shown)) await this.#read(shown);
  }

  /** Asks which clips would make the predictions better. */
  async advise() {
    const question = { campaign: byId("learned-campaign").value, properties: byId("learned-file").value };
    if (!question.campaign || !question.properties || byId("advise").disabled) return;
    const job = await askForJob("/api/advise", question, this.#message);
    if (job === null) return;
    byId("advise").disabled = true;
    follow(job, (event) => {
      if (event.state === "running") return;
      byId("advise").disabled = false;
      if (event.state === "done") showAdvice(event.result.advice);
      else this.#message.error(new Error(event.error ?? "It was cancelled."));
    });
  }

  #showFiles(chosen) {
    fillSelect(byId("learned-file"), this.#contents.properties.map((name) => [name, name]), chosen);
  }

  /** Tracks all clips of the campaign and estimates the properties. */
  async estimate() {
    if (this.#job !== null || byId("learn").disabled) return;
    const question = { campaign: byId("learned-campaign").value, output: byId("learned-output").value };
    const job = await askForJob("/api/estimate", question, this.#message);
    if (job === null) return;
    this.#job = job;
    this.#running(0);
    follow(job, (event) => this.#hear(event).catch(this.#message.error));
  }

  async cancel() {
    if (this.#job !== null) await ask(`/api/jobs/${this.#job}/cancel`, {}).catch(this.#message.error);
  }

  #running(done) {
    byId("learn").disabled = done !== null;
    byId("stop-learning").hidden = done === null;
    byId("learning").hidden = done === null;
    if (done !== null) byId("learning").value = done;
  }

  async #hear(event) {
    if (event.state === "running") return this.#running(event.done);
    this.#job = null;
    this.#running(null);
    if (event.state === "cancelled") return this.#message.tell("The estimate was cancelled; nothing was written.");
    if (event.state === "failed") return this.#message.error(new Error(event.error));
    const { file } = event.result;
    this.#before = byId("learned-file").value === file ? (this.#shown?.properties ?? null) : null;
    this.#message.tell(`Wrote ${file}.`);
    if (!this.#contents.properties.includes(file)) this.#contents.properties.push(file);
    this.#showFiles(file);
    document.dispatchEvent(new Event("learned"));
    return this.#read(file);
  }

  async #read(file) {
    this.#shown = await read("/api/properties", { file });
    byId("before-words").hidden = !this.#before;
    byId("advice").hidden = true;
    byId("learned-warnings").replaceChildren(...warningsByCause(this.#shown.properties));
    this.#draw();
  }

  #draw() {
    const kinds = Object.keys(this.#shown.properties.friction ?? {}).sort();
    const colour = (name) => {
      const rank = kinds.indexOf(kindOf(name.split("/")[0]));
      return rank < 0 ? "grey" : `c${rank % 8}`;
    };
    const charts = GROUPS.map(([key, clipsKey, title]) => this.#chart(this.#shown.properties[key] ?? {}, { clipsKey, before: this.#before?.[key] ?? {} }, title, colour)).filter(Boolean);
    byId("learned-charts").replaceChildren(...charts);
  }

  #chart(values, { clipsKey, before }, title, colour) {
    const rows = Object.entries(values).filter(([, estimate]) => estimate.n > 0 || estimate.standard_error > 0);
    if (!rows.length) return null;
    const clips = this.#shown.clips.filter(({ group }) => group === clipsKey);
    const earlier = rows.flatMap(([name]) => before[name]?.interval_95 ?? []);
    const all = [...rows.flatMap(([, { interval_95: interval }]) => interval), ...earlier, ...clips.map(({ value }) => value)].filter(Number.isFinite);
    const room = 0.06 * (Math.max(...all) - Math.min(...all)) || 0.01;
    const [low, high] = [Math.min(...all) - room, Math.max(...all) + room];
    const width = Math.max(320, byId("learned-charts").clientWidth);
    const x = (value) => LEFT_PX + ((value - low) / (high - low)) * (width - LEFT_PX - RIGHT_PX);
    const height = rows.length * ROW_PX + FOOT_PX;
    const grid = ticks(low, high).flatMap(([value, decimals]) => [
      svg("path", { class: "grid", d: `M${x(value)} 0V${height - FOOT_PX}` }),
      svg("text", { class: "tick", x: x(value), y: height - 8, "text-anchor": "middle" }, fixed(value, decimals)),
    ]);
    const drawn = rows.flatMap(([name, estimate], k) => this.#row(name, estimate, clips, { x, y: (k + 0.5) * ROW_PX, width, colour: colour(name), before: before[name] }));
    return html("figure", {}, html("h2", {}, title), svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": title }, ...grid, ...drawn));
  }

  #row(name, estimate, clips, { x, y, width, colour, before }) {
    const [low, high] = estimate.interval_95;
    const marks = clips.filter((clip) => clip.name === name).map(({ clip, value, std, group }) => {
      const words = `${clip}: ${fixed(value, 3)} \u00b1 ${fixed(std, 3)}`;
      const act = () => this.#open(clip, bodies(group, name));
      const mark = svg("g", { class: `clip-mark ${colour}`, tabindex: 0, role: "link", "aria-label": words, onclick: act },
        svg("circle", { class: "reach", cx: x(value), cy: y + 7, r: 11 }), svg("circle", { class: "clip", cx: x(value), cy: y + 7, r: 4.5 }), svg("title", {}, words));
      mark.addEventListener("keydown", (event) => event.key === "Enter" && act());
      return mark;
    });
    return [
      ...earlierMarks(before, { x, y, width }),
      svg("text", { class: "name", x: LEFT_PX - 14, y: y + 4, "text-anchor": "end" }, name),
      svg("path", { class: `interval ${colour}`, d: `M${x(low)} ${y - 5}H${x(high)}` }),
      svg("circle", { class: `mean ${colour}`, cx: x(estimate.mean), cy: y - 5, r: 5.5 }),
      ...marks,
      svg("text", { class: "number", x: width - RIGHT_PX + 14, y: y + 4 }, `${fixed(estimate.mean, 3)}  (${fixed(low, 3)} to ${fixed(high, 3)})`),
    ];
  }
}

/** The value before the last estimate, above the present one. */
function earlierMarks(before, { x, y, width }) {
  if (!before) return [];
  const [low, high] = before.interval_95;
  const words = `was ${fixed(before.mean, 3)}  (${fixed(low, 3)} to ${fixed(high, 3)})`;
  return [
    svg("path", { class: "interval-before", d: `M${x(low)} ${y - 13}H${x(high)}` }),
    svg("circle", { class: "mean-before", cx: x(before.mean), cy: y - 13, r: 3.5 }),
    svg("text", { class: "number-before", x: width - RIGHT_PX + 14, y: y + 16 }, words),
  ];
}

/** The clips to film next, the most useful first. */
function showAdvice({ spread_m: now, piles, clips }) {
  const head = ["", "strike", "into", "speed (m/s)", "offset (mm)", "final positions then (mm)", "most informative for"];
  const row = ({ strike, into, speed_m_s: speed, offset_m: offset, spread_m: then, tells }, k) => html("tr", {},
    ...[String(k + 1), strike, into ?? "\u2013", fixed(speed, 2), fixed(offset * 1e3, 1), fixed(then * 1e3, 2), tells.slice(0, 2).map(({ quantity }) => quantity).join(", ")]
      .map((text, column) => html(column === 1 ? "th" : "td", column === 1 ? { scope: "row" } : column === 6 ? { class: "text" } : {}, text)));
  byId("advice").replaceChildren(
    html("h2", {}, "What to film next"),
    html("p", { class: "quiet" }, `Predicted final positions are now uncertain by ${fixed(now * 1e3, 1)} mm (1 standard deviation, mean of ${piles} simulated strikes on piles).`),
    html("table", {}, html("thead", {}, html("tr", {}, ...head.map((text) => html("th", { scope: "col" }, text)))), html("tbody", {}, ...clips.map(row))),
  );
  byId("advice").hidden = false;
}

/** The bodies whose impact measured a value; none for friction, which the whole slide measures. */
function bodies(group, name) {
  if (group === "friction") return [name];
  if (group === "striker_restitution") return ["striker", name];
  return name.split("/");
}

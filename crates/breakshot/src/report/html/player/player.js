/** Plays the motions of a report: filmed, fitted and simulated, over each other or side by side. */

import { byId, distance, fixed, html, mm, svg } from "/elements.js";
import { addKeys, startKeys } from "/keys.js";
import { outline, placed } from "/outlines.js";
import { Playback, changePace, moments, playbackKeys } from "/playback.js";
import { Timeline } from "/timeline.js";

/** The units of the numbers in the data: whole microseconds, tenths of a millimetre and milliradians. */
const UNITS = { time: 1e-6, length: 1e-4, angle: 1e-3 };
/** Frames farther apart than this many usual steps have others between them, in which the object was not found. */
const GAP_STEPS = 1.5;
/** A time this close to that of a frame is that of the frame (s). */
const SAME_S = 2e-6;
/** The name of a simulated outline is drawn if it is farther than this from the filmed one (px). */
const NAME_PX = 26;

/** Running sums: the data hold the first number and then the differences. */
function sums(differences, unit) {
  let sum = 0;
  return differences.map((difference) => (sum += difference) * unit);
}

/** The motion of one body. */
class Track {
  constructor({ body, x, y, yaw, doubtful = [] }, times) {
    this.body = body;
    this.times = times;
    [this.x, this.y] = [sums(x, UNITS.length), sums(y, UNITS.length)];
    this.yaw = yaw ? sums(yaw, UNITS.angle) : null;
    this.doubtful = doubtful;
    const steps = times.slice(1).map((time, k) => time - times[k]).sort((a, b) => a - b);
    this.step = steps[steps.length >> 1] ?? 0;
  }

  #frame(k) {
    return [this.x[k], this.y[k], this.yaw ? this.yaw[k] : 0];
  }

  /** `{ pose, state }` at a time; before and after the track its ends, with the state `outside`. The state `missing` has no pose. */
  at(time, isFilm) {
    const { times } = this;
    const last = times.length - 1;
    if (time < times[0] - SAME_S) return { pose: this.#frame(0), state: "outside" };
    if (time > times[last] + SAME_S) return { pose: this.#frame(last), state: "outside" };
    const next = times.findIndex((one) => one > time + SAME_S);
    const k = next < 0 ? last : Math.max(next - 1, 0);
    const isFrame = k === last || Math.abs(times[k] - time) <= SAME_S;
    const doubtful = this.doubtful.includes(k);
    if (isFrame) return { pose: this.#frame(k), state: "frame", doubtful };
    if (isFilm && times[k + 1] - times[k] > GAP_STEPS * this.step) return { pose: null, state: "missing" };
    const part = (time - times[k]) / (times[k + 1] - times[k]);
    const [from, to] = [this.#frame(k), this.#frame(k + 1)];
    return { pose: from.map((value, i) => value + part * (to[i] - value)), state: "between", doubtful };
  }
}

/** The motion of all bodies, as filmed, fitted or simulated. */
class Motion {
  constructor({ kind, clocks, tracks }) {
    this.kind = kind;
    this.isFilm = kind === "filmed";
    const times = clocks.map((clock) => sums(clock, UNITS.time));
    this.tracks = tracks.map((track) => new Track(track, times[track.clock]));
    const longest = times.reduce((a, b) => (b.length > a.length ? b : a), []);
    this.frames = longest;
    this.start = Math.min(...times.map((clock) => clock[0]));
    this.end = Math.max(...times.map((clock) => clock.at(-1)));
  }

  track(body) {
    return this.tracks.find((track) => track.body === body);
  }
}

/** One drawing of the table with one or more motions. */
class Panel {
  #data;
  #drawn;
  #separations = [];

  constructor(ground, data, motions) {
    this.#data = data;
    this.element = ground.cloneNode(true);
    const { bodies } = data;
    const window = this.element.querySelector("svg");
    const tracks = motions.flatMap((motion, k) => motion.tracks.map((track) => ({ motion, track, body: bodies[track.body], isFirst: k === 0 })));
    const paths = tracks.filter(({ body }) => !body.isStriker).map((one) => this.#path(one));
    this.#drawn = tracks.map((one) => ({ ...one, ...this.#body(one) }));
    if (motions.length > 1 && data.is_aligned) {
      this.#separations = motions[0].tracks.filter(({ body }) => motions[1].track(body)).map(({ body }) => ({ body, line: svg("path", { class: "separation" }) }));
    }
    const outlines = this.#drawn.map(({ shape }) => shape);
    const names = this.#drawn.map(({ name }) => name);
    window.append(svg("g", { class: "moving" }, ...paths, ...outlines, ...this.#separations.map(({ line }) => line), ...names.filter(Boolean)));
    const kinds = motions.map(({ kind }) => kind).join(" and ");
    this.element.setAttribute("aria-label", `The table from above: ${bodies.filter((body) => !body.isStriker).map(({ name }) => name).join(", ")}, ${kinds}`);
  }

  #px([x, y]) {
    const { left_m, top_m, px_per_m } = this.#data.view;
    return [(x - left_m) * px_per_m, (top_m - y) * px_per_m];
  }

  #path({ motion, track, body }) {
    const points = track.x.map((x, k) => this.#px([x, track.y[k]]).map((v) => v.toFixed(1)).join(" "));
    const line = points.filter((point, k) => point !== points[k - 1]);
    return svg("path", { class: `path ${motion.kind} ${body.class}`, d: `M${line.join("L")}` });
  }

  /** The outline of a body with its marker, and its name. */
  #body({ motion, body, isFirst }) {
    const scale = this.#data.view.px_per_m;
    const { shape, at_m: at, dot } = body.marker ?? {};
    const marks = [shape && outline(shape, scale, at), dot && outline({ disc: dot }, scale, dot.at_m)].filter(Boolean);
    const group = svg("g", { class: `body ${motion.kind} ${body.class}` },
      svg("path", { class: "outline", d: outline(body.shape, scale) }), ...marks.map((d) => svg("path", { class: "marker", d })));
    const text = isFirst ? body.name : `${body.name}, ${motion.kind}`;
    const name = body.isStriker ? null : svg("text", { class: isFirst ? "name halo" : "small halo", "text-anchor": "middle" }, text);
    return { shape: group, name };
  }

  /** Shows an instant: `states` holds the state of every track. */
  show(states) {
    const places = new Map();
    for (const { motion, track, shape, name } of this.#drawn) {
      const { pose, state, doubtful } = states.get(track);
      shape.setAttribute("visibility", pose ? "visible" : "hidden");
      name?.setAttribute("visibility", pose ? "visible" : "hidden");
      if (!pose) continue;
      const at = this.#px(pose);
      shape.setAttribute("transform", placed(at, pose[2]));
      shape.classList.toggle("doubtful", Boolean(doubtful));
      shape.classList.toggle("outside", motion.isFilm && state === "outside");
      const other = places.get(track.body);
      places.set(track.body, [...(other ?? []), at]);
      if (!name) continue;
      name.setAttribute("x", at[0].toFixed(1));
      name.setAttribute("y", (at[1] + 4.5).toFixed(1));
      if (other && distance(other[0], at) < NAME_PX) name.setAttribute("visibility", "hidden");
    }
    for (const { body, line } of this.#separations) {
      const ends = places.get(body) ?? [];
      line.setAttribute("d", ends.length > 1 ? `M${ends.map((end) => end.map((v) => v.toFixed(1)).join(" ")).join("L")}` : "M0 0");
    }
  }
}

/** Text that a film's state adds to a distance. */
const REMARKS = { between: "between two frames", outside: "outside the film", missing: "not found in this frame" };

class Player {
  #ground;
  #timeline;
  #motions;
  #data;
  #panels = [];
  #rows = [];
  #isBeside = false;

  constructor(root) {
    this.root = root;
    const data = JSON.parse(this.#part("data").textContent);
    data.bodies = data.bodies.map((body) => ({ ...body, isStriker: body.class === "striker" }));
    this.#data = data;
    this.#motions = data.motions.map((motion) => new Motion(motion));
    this.#ground = this.#part("views").firstElementChild;
    this.playback = new Playback({ changed: () => this.#show(), playing: () => this.#button(), pace: () => Number(this.#part("pace").value) });
    this.#timeline = new Timeline(this.#part("timeline"), this.playback);
    this.#listen();
    this.#table();
    this.#impacts(moments(data.events));
    this.#arrange();
    const film = this.#motions.find(({ isFilm }) => isFilm);
    this.playback.time = Infinity;
    this.playback.show({
      start: Math.min(...this.#motions.map(({ start }) => start)),
      end: Math.max(...this.#motions.map(({ end }) => end)),
      moments: moments(data.events),
      frames: film?.frames ?? null,
    });
    root.hidden = false;
    root.closest(".played").classList.add("ready");
    this.#timeline.draw();
    new ResizeObserver(() => this.#scaleText()).observe(this.#part("views"));
  }

  #part(name) {
    return this.root.querySelector(`.${name}`);
  }

  #listen() {
    this.#part("play").addEventListener("click", () => this.playback.toggle());
    this.#part("back").addEventListener("click", () => this.playback.step(-1));
    this.#part("forth").addEventListener("click", () => this.playback.step(1));
    this.#part("beside")?.addEventListener("click", () => this.turn());
  }

  /** Shows the motions side by side, or again over each other. */
  turn() {
    if (this.#motions.length < 2) return;
    this.#isBeside = !this.#isBeside;
    this.#part("beside").setAttribute("aria-pressed", this.#isBeside);
    this.#arrange();
    this.#show();
  }

  #arrange() {
    const groups = this.#isBeside ? this.#motions.map((motion) => [motion]) : [this.#motions];
    this.#panels = groups.map((group) => new Panel(this.#ground, this.#data, group));
    const titled = ({ element }, k) => html("figure", {}, ...(this.#isBeside ? [html("figcaption", {}, groups[k][0].kind)] : []), element);
    this.#part("views").classList.toggle("side-by-side", this.#isBeside);
    this.#part("views").classList.toggle("compared", this.#motions.length > 1);
    this.#part("views").replaceChildren(...this.#panels.map(titled));
    this.#scaleText();
  }

  /** Text keeps its size where a drawing is shown smaller than it is. */
  #scaleText() {
    for (const { element } of this.#panels) {
      const shown = element.getBoundingClientRect().width;
      if (shown > 0) element.style.setProperty("--text", Math.max(1, element.viewBox.baseVal.width / shown).toFixed(3));
    }
  }

  #table() {
    const [film, other] = this.#motions;
    if (!other || !this.#data.is_aligned) return;
    const bodies = film.tracks.map(({ body }) => body).filter((body) => other.track(body));
    this.#rows = bodies.map((body) => ({ body, cells: [html("td"), html("td", { class: "text" })] }));
    const rows = this.#rows.map(({ body, cells }) => html("tr", {}, html("th", { scope: "row" }, this.#data.bodies[body].name), ...cells));
    this.#part("now").querySelector("tbody").replaceChildren(...rows);
  }

  #impacts(found) {
    const item = ({ time, words }) => html("li", {}, html("button", { type: "button", onclick: () => this.playback.stopAt(time) },
      html("span", { class: "quiet" }, `${fixed(time, 3)} s`), " ", words.join(", ")));
    this.#part("impacts").replaceChildren(...found.map(item));
    this.#part("impacts").hidden = !found.length;
  }

  #button() {
    this.#part("play").textContent = this.playback.isPlaying ? "Pause" : "Play";
  }

  #show() {
    const { time, lastImpact, moments: impacts } = this.playback;
    const states = new Map(this.#motions.flatMap((motion) => motion.tracks.map((track) => [track, track.at(time, motion.isFilm)])));
    for (const panel of this.#panels) panel.show(states);
    this.#timeline.update();
    this.#part("time").textContent = `${fixed(time, 3)} s`;
    const words = lastImpact ? `impact ${lastImpact.number} of ${impacts.length}: ${lastImpact.words}` : `${impacts.length || "no"} ${impacts.length === 1 ? "impact" : "impacts"} to come`;
    const film = this.#motions.find(({ isFilm }) => isFilm);
    const filmTime = film && this.#data.film_start_s ? `${fixed(time + this.#data.film_start_s, 3)} s in the film; ` : "";
    this.#part("event").textContent = `${filmTime}${words}`;
    this.#part("event").classList.toggle("now", Boolean(lastImpact?.isNow));
    this.#showDistances(states);
    [...this.#part("impacts").children].forEach((item, k) => item.firstChild.toggleAttribute("aria-current", k + 1 === lastImpact?.number));
  }

  #showDistances(states) {
    const [film, other] = this.#motions;
    for (const { body, cells: [value, remark] } of this.#rows) {
      const [a, b] = [film, other].map((motion) => states.get(motion.track(body)));
      const remarks = [REMARKS[a.state], a.doubtful ? "doubtful" : null].filter(Boolean);
      value.textContent = a.pose && b.pose ? `${mm(distance(a.pose, b.pose))} mm` : "\u2013";
      remark.textContent = remarks.join(", ");
    }
  }
}

/** Makes players of all motions of the page; the drawings of one that fails stay as they are. */
function start() {
  const players = new Map();
  for (const root of document.querySelectorAll(".player")) {
    try {
      players.set(root, new Player(root));
    } catch (error) {
      console.error(error);
    }
  }
  const of = (event) => players.get(event.target.closest(".player"));
  const isFor = (target) => Boolean(target.closest?.(".player")) && !target.matches("select");
  const pace = (by, event) => changePace(event.target.closest(".player").querySelector(".pace"), by);
  addKeys({ title: "A motion with the focus", isFor }, [
    ...playbackKeys((event) => of(event).playback, pace),
    [["b"], "side by side, or over each other", (_, event) => of(event).turn()],
  ]);
  startKeys();
  byId("about-keys").hidden = false;
  byId("close-keys").addEventListener("click", () => byId("keys").close());
}

start();

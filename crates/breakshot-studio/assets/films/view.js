/** The films of a campaign: frames as the detector saw them, what was found in them, and when. */

import { byId, fillSelect, fixed, html, prose, showNothing, svg } from "/elements.js";
import { ClipEdit } from "/films/edit.js";
import { Frames } from "/films/frames.js";
import { Plots } from "/films/plots.js";
import { Starts } from "/films/starts.js";
import { addKeys } from "/keys.js";
import { Newest, ask, askForJob, follow, read } from "/server.js";
import { kindOf } from "/table.js";

/** Two times of one frame differ by less (s). */
const SAME_S = 2e-3;
const LARGE_STEP = 10;

export class Films {
  #message;
  #frames = new Frames();
  #clips = [];
  #clip = -1;
  /** How often a clip was opened: what an earlier opening still waits for is not shown. */
  #opened = 0;
  #motion = null;
  #count = 0;
  /** The frame that a person is at; its picture may still be on its way. */
  #number = 0;
  #time = 0;
  #step = 1 / 60;
  #timer = null;
  #started = null;
  #contents = null;
  /** The job that tracks a clip. */
  #tracking = null;

  constructor(message) {
    this.#message = message;
    this.plots = new Plots((time) => this.goTo(time));
    this.showing = new Newest(({ number, direction }) => this.#frames.frame(number, direction), (frame, { number }) => this.#draw(frame, number), message.error);
    byId("campaign").addEventListener("change", (event) => this.#openCampaign(event.target.value).catch(message.error));
    byId("film-play").addEventListener("click", () => this.toggle());
    byId("film-back").addEventListener("click", () => this.step(-1));
    byId("film-forth").addEventListener("click", () => this.step(1));
    byId("film-position").addEventListener("input", (event) => this.#pausedAt(Number(event.target.value)));
    byId("outlines").addEventListener("change", () => this.#drawOverlay());
    byId("track").addEventListener("click", () => this.track());
    this.starts = new Starts(message, this);
    document.addEventListener("learned", () => this.#started && this.reopen(this.clip?.name).catch(message.error));
    this.#addKeys();
    this.edit = new ClipEdit(message, this);
  }

  /** The file of the campaign that is open. */
  get campaign() {
    return byId("campaign").value;
  }

  /** The clip that is open, as it is listed. */
  get clip() {
    return this.#clips[this.#clip];
  }

  /** The time of the frame that is shown (s). */
  get time() {
    return this.#time;
  }

  /** The number of the clip that is open. */
  get clipNumber() {
    return this.#clip;
  }

  /** The class of an object's colour. */
  colour(name) {
    return this.#colour(name);
  }

  /** Goes to the first frame. */
  toFirst() {
    this.#pausedAt(0);
  }

  /** Changes the clip that is open. */
  save(change) {
    return this.edit.save(change);
  }

  /** Draws what was found anew. */
  redraw() {
    this.#drawOverlay();
  }

  /** Files were changed: the campaign is read again if it is another one. */
  async refresh({ campaigns, cells, objects }) {
    const { campaign } = this;
    if (!campaigns.length && cells.length && objects.length) return void this.#offerFirst();
    fillSelect(byId("campaign"), campaigns.map((name) => [name, name]), campaigns.includes(campaign) ? campaign : undefined);
    byId("films").classList.toggle("empty", !campaigns.length);
    if (!campaigns.length || this.#tracking !== null || this.starts.isOn) return;
    const clips = await read("/api/clips", { campaign: this.campaign });
    if (JSON.stringify(clips) !== JSON.stringify(this.#clips)) await this.reopen(this.clip?.name);
  }

  /** Reads the campaign again; the clip of this name stays open, at its frame unless it is `isNew`. */
  async reopen(name, isNew = false) {
    if (!this.#contents.campaigns.length) {
      this.#contents.campaigns.push(this.campaign);
      fillSelect(byId("campaign"), [[this.campaign, this.campaign]]);
    }
    await this.#openCampaign(this.campaign, name, !isNew);
  }

  /** Opens the first campaign of the project. */
  start(contents) {
    this.#started ??= this.#startOnce(contents);
    return this.#started;
  }

  /** What a film needs besides its name and objects: the cell and the objects of a campaign that does not exist yet. */
  get firstFields() {
    const { campaigns, cells, objects } = this.#contents;
    return campaigns.length ? {} : { cell_file: cells[0], objects_file: objects[0] };
  }

  #offerFirst() {
    fillSelect(byId("campaign"), [["campaign.toml", "campaign.toml (new)"]]);
    byId("films").classList.remove("empty");
    byId("plots-words").textContent = "No films yet: add them (f), or drop them here. They are copied into this folder and listed in campaign.toml.";
    byId("track").disabled = true;
    byId("clip-edit").hidden = true;
  }

  async #startOnce(contents) {
    this.#contents = contents;
    const { campaigns, cells, objects } = contents;
    fillSelect(byId("campaign"), campaigns.map((name) => [name, name]));
    if (campaigns.length) await this.#openCampaign(campaigns[0]);
    else if (cells.length && objects.length) this.#offerFirst();
    else showNothing("films", "This folder holds no campaign. ", html("code", {}, "breakshot campaign"), " drafts one from a folder of films.");
  }

  async #openCampaign(campaign, chosen = null, stays = false) {
    this.#clips = await read("/api/clips", { campaign });
    this.#list();
    const k = this.#clips.findIndex(({ name }) => name === chosen);
    if (this.#clips.length) await this.open(Math.max(k, 0), stays && k >= 0);
  }

  #list() {
    const item = ({ name, objects, is_film: isFilm, is_tracked: isTracked, is_excluded: isExcluded, excluded_s: stretches }, k) => {
      const found = isFilm ? (isTracked ? "tracked" : "not tracked") : "tracks only";
      const marks = isExcluded ? "left out" : stretches.length ? `${found} \u00b7 in part left out` : found;
      return html("li", {}, html("button", { type: "button", onclick: () => this.open(k).catch(this.#message.error) },
        html("b", {}, name), html("small", {}, `${objects.join(", ")} \u00b7 ${marks}`)));
    };
    const buttons = () => [...byId("clips").querySelectorAll("button")];
    const focused = buttons().indexOf(document.activeElement);
    byId("clips").replaceChildren(...this.#clips.map(item));
    buttons()[focused]?.focus({ preventScroll: true });
    this.#mark();
  }

  /** Marks the clip that is open. */
  #mark() {
    [...byId("clips").querySelectorAll("button")].forEach((button, i) => (i === this.#clip ? button.setAttribute("aria-current", "true") : button.removeAttribute("aria-current")));
  }

  /** Opens a clip of this name where `where` says: `{ a, b }` for an impact. */
  async openAt(name, where) {
    await this.#started;
    const k = this.#clips.findIndex((clip) => clip.name === name);
    if (k < 0) throw new Error(`The campaign that is open has no clip ${name}.`);
    await this.open(k);
    const impact = this.#motion?.impacts.find(({ a, b }) => {
      const bodies = [a, b].filter(Boolean).map(kindOf);
      return !where || where.every((body) => bodies.includes(body));
    });
    if (impact) this.goTo(impact.time_s);
  }

  /** Opens clip number `k` at its first frame; if it `stays` open, at the frame where a person is when it has been read. */
  async open(k, stays = false) {
    this.pause();
    this.showing.drop();
    const opened = ++this.#opened;
    const isLate = () => opened !== this.#opened;
    const at = { campaign: byId("campaign").value, clip: k };
    [this.#clip, this.#motion] = [k, null];
    if (!stays) this.#number = 0;
    this.#mark();
    const film = await read("/api/film", at);
    if (isLate()) return;
    this.#count = film?.frame_count ?? 1;
    this.#frames.open(at, this.#count);
    byId("film-position").max = this.#count - 1;
    if (film) {
      const [first, second] = await Promise.all([this.#frames.frame(0), this.#frames.frame(1)]);
      if (isLate()) return;
      this.#step = second ? second.time - first.time : 1 / 60;
      this.go(this.#number);
    }
    const motion = await read("/api/clip", at);
    if (isLate()) return;
    this.#show(motion);
    await this.edit.show();
  }

  #colour = (name) => {
    const kinds = [...new Set(this.#clips.flatMap(({ objects }) => objects.map(kindOf)))].sort();
    return `c${kinds.indexOf(kindOf(name)) % 8}`;
  };

  #show(motion) {
    this.#motion = motion;
    this.plots.show(motion, this.#colour);
    this.#trackButton();
    byId("plots-words").textContent = motion ? "" : "Not tracked yet: Track (t) finds the objects in every frame.";
    const impacts = (motion?.impacts ?? []).map(({ time_s, a, b, restitution }) => html("li", {},
      html("button", { type: "button", onclick: () => this.goTo(time_s) }, html("b", {}, `${a ?? "something"} hits ${b}`),
        html("small", {}, `${fixed(time_s, 3)} s${restitution == null ? "" : ` \u00b7 restitution ${fixed(restitution, 2)}`}`))));
    byId("impacts").replaceChildren(...(impacts.length ? impacts : [html("li", { class: "quiet" }, "none")]));
    const warnings = motion?.warnings ?? [];
    const doubtful = (motion?.objects ?? []).map(({ name, samples }) => [name, samples.filter((s) => s.is_doubtful).length]).filter(([, n]) => n);
    const words = [...warnings, ...doubtful.map(([name, n]) => `${name}: ${n} doubtful ${n === 1 ? "position" : "positions"}, drawn with dashes`)];
    byId("clip-warnings").replaceChildren(...(words.length ? words : ["nothing"]).map((text) => html("li", { class: words.length ? "" : "quiet" }, html("span", {}, ...prose(text)))));
    this.#drawOverlay();
  }

  #draw(frame, number) {
    if (!frame) {
      // The film has ended before.
      if (number > 0) this.#pausedAt(number - 1, -1);
      this.#count = Math.max(1, Math.min(this.#count, number));
      byId("film-position").max = this.#count - 1;
      return null;
    }
    const canvas = byId("frame");
    const { width, height } = frame.bitmap;
    if (canvas.width !== width || canvas.height !== height) {
      [canvas.width, canvas.height] = [width, height];
      for (const id of ["overlay", "starts"]) byId(id).setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    }
    canvas.getContext("2d", { alpha: false }).drawImage(frame.bitmap, 0, 0);
    this.#time = frame.time;
    canvas.dataset.frame = number;
    byId("film-position").value = number;
    byId("film-position").setAttribute("aria-valuetext", `frame ${number}, ${fixed(frame.time, 3)} seconds`);
    const isLeftOut = this.clip?.excluded_s.some(([from, until]) => from <= frame.time && frame.time <= until);
    byId("film-time").textContent = `${isLeftOut ? "left out \u00b7 " : ""}${fixed(frame.time, 3)} s \u00b7 ${number + 1}/${this.#count}`;
    this.plots.at(frame.time);
    this.#drawOverlay();
    return null;
  }

  #drawOverlay() {
    const shown = byId("outlines").checked && !this.starts.isOn ? this.#motion : null;
    const ring = (points) => `M${points.map((p) => p.map((v) => v.toFixed(2)).join(" ")).join("L")}Z`;
    const objects = (shown?.objects ?? []).flatMap(({ name, samples }) => {
      const so = samples.filter(({ time_s, center_px: c }) => c && time_s <= this.#time + SAME_S);
      const sample = so.at(-1);
      if (!sample || sample.time_s < this.#time - this.#step / 2) return [];
      const way = so.map(({ center_px: p }) => p.map((v) => v.toFixed(2)).join(" "));
      const [x, y] = sample.center_px;
      const top = Math.min(y - 20, ...sample.outline_px.map((p) => p[1]));
      return [
        svg("path", { class: `way ${this.#colour(name)}`, d: `M${way.join("L")}` }),
        sample.outline_px.length ? svg("path", { class: `found ${this.#colour(name)} ${sample.is_doubtful ? "doubtful" : ""}`, d: ring(sample.outline_px) }) : "",
        svg("path", { class: `center ${this.#colour(name)}`, d: `M${x - 7} ${y}H${x + 7}M${x} ${y - 7}V${y + 7}` }),
        svg("text", { class: "found-name", x, y: top - 12, "text-anchor": "middle" }, name),
      ];
    });
    const impacts = (shown?.impacts ?? []).filter(({ time_s, point_px }) => point_px && Math.abs(time_s - this.#time) <= 1.5 * this.#step)
      .map(({ point_px: [x, y] }) => svg("path", { class: "hit", d: `M${x - 16} ${y - 16}L${x + 16} ${y + 16}M${x - 16} ${y + 16}L${x + 16} ${y - 16}` }));
    byId("overlay").replaceChildren(...objects.filter(Boolean), ...impacts);
  }

  /** Goes to a frame. */
  go(number, direction = 1) {
    const wanted = Math.min(Math.max(number, 0), this.#count - 1);
    this.#number = wanted;
    this.showing.want({ number: wanted, direction });
  }

  #pausedAt(number, direction) {
    this.pause();
    this.go(number, direction);
  }

  step(by) {
    this.#pausedAt(this.#number + by, Math.sign(by) || 1);
  }

  /** Goes to the frame at a time. */
  goTo(time) {
    this.#pausedAt(Math.round(time / this.#step));
  }

  toggle() {
    if (this.#timer) this.pause();
    else this.play();
  }

  play() {
    if (this.#number >= this.#count - 1) this.go(0);
    byId("film-play").textContent = "Pause";
    this.#timer = setInterval(() => {
      if (this.#number >= this.#count - 1) this.pause();
      else this.go(this.#number + 1);
    }, Math.max(16, this.#step * 1e3));
  }

  pause() {
    clearInterval(this.#timer);
    this.#timer = null;
    byId("film-play").textContent = "Play";
  }

  #impact(direction) {
    const times = (this.#motion?.impacts ?? []).map(({ time_s }) => time_s);
    const next = direction > 0 ? times.find((time) => time > this.#time + this.#step) : times.findLast((time) => time < this.#time - this.#step);
    if (next != null) this.goTo(next);
    else this.#pausedAt(direction > 0 ? this.#count - 1 : 0);
  }

  #trackButton() {
    byId("track").textContent = this.#tracking !== null ? "Cancel" : this.#motion ? "Track again" : "Track";
    byId("tracking").hidden = this.#tracking === null;
  }

  /** Tracks the clip that is open, or ends the tracking. */
  async track() {
    if (this.#tracking !== null) return void (await ask(`/api/jobs/${this.#tracking}/cancel`, {}).catch(this.#message.error));
    const [clip, campaign] = [this.#clip, byId("campaign").value];
    const job = await askForJob("/api/track", { campaign, clip: String(clip) }, this.#message);
    if (job === null) return;
    const before = this.#number;
    this.#tracking = job;
    this.starts.off();
    this.#trackButton();
    byId("tracking").value = 0;
    follow(job, async (event) => {
      if (event.state === "running") return this.#tracks(event.done, clip);
      this.#tracking = null;
      this.#trackButton();
      if (clip === this.#clip && !this.#timer) this.go(before);
      if (event.state !== "done") return this.#message.error(new Error(event.error ?? "The tracking was cancelled."));
      this.#message.tell(`Wrote ${event.result.file}.`);
      if (campaign === this.campaign && this.#clips[clip]) {
        this.#clips[clip].is_tracked = true;
        this.#list();
      }
      if (clip === this.#clip) this.#show(await read("/api/clip", { campaign, clip }));
    });
  }

  /** The film runs along with its tracking, unless a person plays it. */
  #tracks(done, clip) {
    byId("tracking").value = done;
    if (clip !== this.#clip || this.#timer) return;
    const frame = Math.round(done * (this.#count - 1));
    this.#message.tell(`Tracking: frame ${frame + 1} of ${this.#count}.`);
    this.go(frame);
  }

  #addKeys() {
    addKeys({ title: "The film", view: "films", isFor: (target) => !target.matches("select, input[type=text]") }, [
      [["Space"], "play or pause", () => this.toggle()],
      [["ArrowLeft"], "one frame back", () => this.step(-1)],
      [["ArrowRight"], "one frame forth", () => this.step(1)],
      [["PageUp"], "ten frames back", () => this.step(-LARGE_STEP)],
      [["PageDown"], "ten frames forth", () => this.step(LARGE_STEP)],
      [["Ctrl+ArrowLeft"], "to the impact before", () => this.#impact(-1)],
      [["Ctrl+ArrowRight"], "to the next impact", () => this.#impact(1)],
      [["Home"], "to the first frame", () => this.#pausedAt(0)],
      [["End"], "to the last frame", () => this.#pausedAt(this.#count - 1)],
      [["[", "]"], "the clip before, the next clip", (key) => this.#other(key === "[" ? -1 : 1)],
      [["o"], "outlines on or off", () => byId("outlines").click()],
      [["t"], "track the clip, or cancel that", () => this.track()],
    ]);
  }

  #other(by) {
    const k = this.#clip + by;
    if (this.#clips[k]) this.open(k).catch(this.#message.error);
  }
}

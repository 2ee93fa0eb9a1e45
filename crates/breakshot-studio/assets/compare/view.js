/** A filmed strike and its simulation on one time axis: over each other in the film and on the table, distances, and reasons for the difference. */

import { byId, fillSelect, fixed, html, showNothing } from "/elements.js";
import { Distances } from "/compare/distances.js";
import { FilmPane } from "/compare/film.js";
import { Findings } from "/compare/findings.js";
import { NewComparison } from "/compare/new.js";
import { TablePane } from "/compare/table.js";
import { addKeys } from "/keys.js";
import { Playback, changePace, moments, playbackKeys } from "/playback.js";
import { read } from "/server.js";
import { Timeline } from "/timeline.js";

/** Two times of one frame differ by less (s). */
const SAME_S = 1e-9;
/** What is shown: the values of the list, in the order of the key. */
const PANES = ["beside", "film", "table"];

export class Compare {
  #message;
  #contents = null;
  #shown = null;
  #frame = -1;

  constructor(message) {
    this.#message = message;
    this.playback = new Playback({
      changed: () => this.#update(),
      playing: () => this.#button(),
      pace: () => Number(byId("compare-pace").value),
    });
    this.timeline = new Timeline(byId("compare-timeline"), this.playback);
    this.film = new FilmPane(message);
    this.table = new TablePane();
    this.distances = new Distances((time) => this.playback.stopAt(time));
    this.findings = new Findings({ go: (time) => this.playback.stopAt(time), pair: (pair) => this.distances.select(pair) });
    this.form = new NewComparison(message, (file) => this.#written(file));
    byId("compare-file").addEventListener("change", (event) => this.open(event.target.value).catch(message.error));
    byId("compare-panes").addEventListener("change", () => this.#panes());
    byId("compare-outlines").addEventListener("change", () => this.#drawFrame());
    byId("compare-play").addEventListener("click", () => this.playback.toggle());
    byId("compare-back").addEventListener("click", () => this.playback.step(-1));
    byId("compare-forth").addEventListener("click", () => this.playback.step(1));
    this.#addKeys();
  }

  #addKeys() {
    const isFor = (target) => !target.matches("select, input[type=text]");
    addKeys({ title: "Film and simulation", view: "compare", isFor }, [
      ...playbackKeys(() => this.playback, (by) => changePace(byId("compare-pace"), by)),
      [["b"], "film and table, film, table", () => this.#nextPanes()],
      [["o"], "outlines in the film on or off", () => byId("compare-outlines").click()],
      [["[", "]"], "the pair before, the next pair", (key) => this.findings.other(key === "[" ? -1 : 1)],
    ]);
    addKeys({ title: "Comparisons", view: "compare" }, [
      [["c"], "compare a film with its simulation", () => this.form.start()],
      [["Escape"], "cancel the comparison", () => this.form.cancel()],
    ]);
  }

  async start(contents) {
    this.#contents = contents;
    const { comparisons, scenes, films, tracks } = contents;
    if (!comparisons.length && (!scenes.length || !(films.length || tracks.length))) {
      showNothing("compare", "This folder holds no output of ", html("code", {}, "breakshot verify"), ", and no film and scene to compare.");
      return;
    }
    this.form.show(contents);
    this.#files(comparisons[0]);
    if (comparisons.length) await this.open(comparisons[0]);
    else this.#nothing();
  }

  /** Files were changed: the lists are shown anew. */
  async refresh(contents) {
    if (byId("compare").classList.contains("empty")) {
      byId("compare").classList.remove("empty");
      return this.start(contents);
    }
    this.form.show(contents);
    this.#files(byId("compare-file").value);
    return null;
  }

  #files(chosen) {
    const { comparisons } = this.#contents;
    fillSelect(byId("compare-file"), comparisons.map((name) => [name, name]), chosen);
    byId("compare-file").disabled = !comparisons.length;
  }

  #nothing() {
    byId("compare-shown").hidden = true;
    byId("compare-results").hidden = true;
    byId("compare-none").hidden = false;
    for (const id of ["compare-panes", "compare-outlines"]) byId(id).disabled = true;
  }

  async #written(file) {
    if (!this.#contents.comparisons.includes(file)) this.#contents.comparisons.push(file);
    this.#files(file);
    await this.open(file);
  }

  /** Opens a comparison: a `report.json` with tracks and trajectory beside it. */
  async open(file) {
    this.playback.pause();
    const shown = await read("/api/comparison", { file });
    this.#message.clear();
    this.#shown = shown;
    for (const id of ["compare-shown", "compare-results"]) byId(id).hidden = false;
    byId("compare-none").hidden = true;
    byId("compare-panes").disabled = !shown.film;
    byId("compare-outlines").disabled = !shown.film;
    const colour = this.table.show(shown);
    this.film.open(shown, colour);
    this.findings.show(shown, colour);
    this.#showTimes();
    this.distances.show(shown, this.playback);
    this.findings.select(this.findings.largest);
    this.#panes();
    this.playback.stopAt(0);
  }

  #showTimes() {
    const { frames_s: frames, trajectory } = this.#shown;
    const ends = [trajectory.duration_s, ...frames.slice(-1)];
    this.#frame = -1;
    this.playback.show({ start: Math.min(0, ...frames.slice(0, 1)), end: Math.max(...ends), moments: moments(trajectory.events), frames });
    this.timeline.draw();
  }

  #panes() {
    const wanted = this.#shown?.film ? byId("compare-panes").value : "table";
    byId("compare-pictures").dataset.panes = wanted;
    byId("compare-film").hidden = wanted === "table";
    byId("compare-table").hidden = wanted === "film";
    if (this.#shown) this.#redraw();
  }

  #nextPanes() {
    const list = byId("compare-panes");
    if (list.disabled) return;
    list.value = PANES[(PANES.indexOf(list.value) + 1) % PANES.length];
    this.#panes();
  }

  #redraw() {
    this.table.resize();
    this.#frame = -1;
    this.#update();
  }

  #button() {
    byId("compare-play").textContent = this.playback.isPlaying ? "Pause" : "Play";
  }

  /** The number of the frame that is shown at a time: the last one that has begun. */
  #frameAt(time) {
    const { frames_s: frames } = this.#shown;
    return Math.max(0, frames.findLastIndex((begun) => begun <= time + SAME_S));
  }

  #update() {
    if (!this.#shown) return;
    const { time, lastImpact, moments: impacts } = this.playback;
    const { frames_s: frames, film, start_s: start } = this.#shown;
    this.timeline.update();
    this.#frame = this.#frameAt(time);
    // Film and simulation are drawn at the same instant: that of the frame, and after the last one any.
    const hasFrame = frames.length > 0 && time <= frames.at(-1) + SAME_S;
    const instant = hasFrame ? frames[this.#frame] : time;
    byId("compare-time").textContent = `${fixed(instant, 3)} s`;
    const number = film ? `film ${fixed(instant + start, 3)} s, frame ${this.#frame + 1} of ${frames.length}` : `sample ${this.#frame + 1} of ${frames.length}`;
    const words = lastImpact ? `simulated impact ${lastImpact.number} of ${impacts.length}: ${lastImpact.words}` : `${impacts.length} simulated impacts`;
    byId("compare-event").textContent = `${hasFrame || !frames.length ? number : "after the film"} \u00b7 ${words}`;
    this.#drawFrame();
    this.table.at(this.#frame, instant);
    this.distances.at(instant);
    this.findings.at(this.#frame, hasFrame);
  }

  #drawFrame() {
    if (this.#shown?.film && !byId("compare-film").hidden) this.film.at(this.#frame, byId("compare-outlines").checked);
  }
}

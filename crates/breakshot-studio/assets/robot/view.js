/** The joint path of a strike: the arm from above and from the side, its joints' speeds, and how near it comes to its limits. */

import { byId, fillSelect, fixed, html, mm, prose, showNothing } from "/elements.js";
import { addKeys } from "/keys.js";
import { Playback, changePace, playbackKeys } from "/playback.js";
import { Arm } from "/robot/arm.js";
import { Speeds } from "/robot/speeds.js";
import { Newest, ask } from "/server.js";
import { Timeline } from "/timeline.js";

/** Two times that differ by less are equal (s). */
const SAME_S = 1e-9;

export class RobotView {
  #message;
  #path = null;
  #contents = null;

  constructor(message) {
    this.#message = message;
    this.playback = new Playback({
      changed: () => this.#update(),
      playing: () => { byId("robot-play").textContent = this.playback.isPlaying ? "Pause" : "Play"; },
      pace: () => Number(byId("robot-pace").value),
    });
    this.timeline = new Timeline(byId("robot-timeline"), this.playback);
    this.arm = new Arm();
    this.speeds = new Speeds((time) => this.playback.stopAt(time));
    this.asking = new Newest((question) => ask("/api/command", question), (found) => this.#show(found), (error) => this.#failed(error));
    byId("robot-strike").addEventListener("change", () => this.#fitting());
    for (const id of ["robot-cell", "robot-strike", "robot-scene"]) byId(id).addEventListener("change", () => this.#ask());
    byId("robot-play").addEventListener("click", () => this.playback.toggle());
    byId("robot-back").addEventListener("click", () => this.playback.step(-1));
    byId("robot-forth").addEventListener("click", () => this.playback.step(1));
    const isFor = (target) => !target.matches("select");
    addKeys({ title: "The arm", view: "robot", isFor }, [
      ...playbackKeys(() => this.playback, (by) => changePace(byId("robot-pace"), by)).map(([names, words, act]) => [names, words.replace("impact", "phase"), act]),
      [["k"], "to the contact", () => this.#path && this.playback.stopAt(this.#path.stroke.contact_time_s)],
    ]);
  }

  async start(contents) {
    this.#contents = contents;
    const { cells, strikes, plans, scenes } = contents;
    if (!cells.length || !(strikes.length || plans.length)) {
      showNothing("robot", "This folder holds no cell with a plan or a strike. ", html("code", {}, "breakshot plan"), " writes a plan, the view Pile saves a strike.");
      return;
    }
    fillSelect(byId("robot-cell"), cells.map((name) => [name, name]));
    fillSelect(byId("robot-strike"), [...plans, ...strikes].map((name) => [name, name]));
    fillSelect(byId("robot-scene"), [["", "of the plan"], ...scenes.map((name) => [name, name])]);
    this.#fitting();
    this.#ask();
  }

  /** Files were changed: the lists are shown anew. */
  async refresh(contents) {
    if (byId("robot").classList.contains("empty")) {
      byId("robot").classList.remove("empty");
      return this.start(contents);
    }
    const { cells, strikes, plans, scenes } = contents;
    const chosen = ["robot-cell", "robot-strike", "robot-scene"].map((id) => byId(id).value);
    fillSelect(byId("robot-cell"), cells.map((name) => [name, name]), chosen[0]);
    fillSelect(byId("robot-strike"), [...plans, ...strikes].map((name) => [name, name]), chosen[1]);
    fillSelect(byId("robot-scene"), [["", "of the plan"], ...scenes.map((name) => [name, name])], chosen[2]);
    return null;
  }

  /** Chooses the scene by the name of the strike, where there is one and the file is not a plan with its own. */
  #fitting() {
    const list = byId("robot-scene");
    const strike = byId("robot-strike").value;
    const stem = strike.replace(/\.json$/, "").replace(/\.strike$/, "");
    const named = [...list.options].find(({ value }) => value === `${stem}.scene.toml` || value === `${stem}.toml`);
    list.value = named && !this.#contents.plans.includes(strike) ? named.value : "";
  }

  #ask() {
    this.playback.pause();
    const [cell, strike, scene] = ["robot-cell", "robot-strike", "robot-scene"].map((id) => byId(id).value);
    // A file with only a strike has no scene of its own.
    byId("robot-scene").options[0].textContent = this.#contents.plans.includes(strike) ? "of the plan" : "none";
    this.asking.want({ cell, strike, scene: scene || null });
  }

  #failed(error) {
    this.#without(error.message, true);
  }

  /** Shows why there is no path. */
  #without(reason, isError = false) {
    this.#path = null;
    for (const id of ["robot-shown", "robot-results"]) byId(id).hidden = true;
    byId("robot-reason").replaceChildren(...prose(reason));
    byId("robot-reason").classList.toggle("no", isError);
    byId("robot-reason").hidden = false;
  }

  #show(found) {
    this.#message.clear();
    if (found.outcome === "missing") return this.#without(found.needed);
    if (found.outcome === "refused") {
      const { reason, fastest_m_s: fastest } = found.refusal;
      return this.#without(`Refused: ${reason}.${fastest == null ? "" : ` The fastest that the joints' speeds allow on this line is ${fixed(fastest, 2)} m/s.`}`);
    }
    this.#path = found;
    byId("robot-reason").hidden = true;
    for (const id of ["robot-shown", "robot-results"]) byId(id).hidden = false;
    this.arm.show(found);
    const begins = found.phases.map(({ label, span_s: [from] }) => ({ time: from, words: [label] }));
    this.playback.show({ end: found.duration_s, moments: begins, frames: found.time_s });
    this.timeline.draw();
    this.speeds.show(found);
    this.#summary(found);
    return this.playback.stopAt(found.stroke.contact_time_s);
  }

  #summary({ arm, strike, stroke, hash, phases, checks, notes, warnings }) {
    byId("robot-speed").textContent = `${fixed(stroke.contact_speed_m_s, 3)} m/s`;
    byId("robot-words").textContent = `${arm} would strike ${fixed(stroke.contact_time_s, 2)} s after it starts; planned are ${fixed(strike.speed_m_s, 3)} m/s`;
    const rows = [
      ["run-up", `${mm(stroke.run_up_m, 0)} mm`], ["stop", `${mm(stroke.stop_m, 0)} mm`], ["acceleration", `at most ${fixed(stroke.acceleration_m_s2, 1)} m/s\u00b2`],
      ["effective mass of the tip", `${fixed(stroke.effective_mass_kg, 2)} kg`], ["its energy", `${fixed(stroke.energy_j, 2)} J`], ["hash", hash],
    ];
    byId("robot-stroke").replaceChildren(...rows.flatMap(([name, value]) => [html("dt", {}, name), html("dd", {}, value)]));
    const go = (time) => () => this.playback.stopAt(time);
    byId("robot-phases").replaceChildren(...phases.map(({ label, span_s: [from, to] }) =>
      html("li", {}, html("button", { type: "button", onclick: go(from) }, html("b", {}, label), html("small", {}, `${fixed(from, 2)} to ${fixed(to, 2)} s`)))));
    byId("robot-checks").replaceChildren(...checks.map(({ sentence, time_s: time }) => html("li", {}, html("button", { type: "button", title: "shows this instant", onclick: go(time) }, ...prose(sentence)))));
    byId("robot-notes").replaceChildren(...[...warnings, ...notes].map((text) => html("li", {}, html("span", {}, ...prose(text)))));
  }

  #update() {
    if (!this.#path) return;
    const { time } = this.playback;
    const { time_s: times, tip_speed_m_s: speeds, phases } = this.#path;
    const k = Math.max(0, times.findLastIndex((one) => one <= time + SAME_S));
    this.timeline.update();
    byId("robot-time").textContent = `${fixed(times[k], 3)} s`;
    const phase = phases.findLast(({ span_s: [from] }) => from <= times[k] + SAME_S) ?? phases[0];
    byId("robot-event").textContent = `${phase.label} \u00b7 the tip moves at ${fixed(speeds[k], 3)} m/s`;
    this.arm.at(k);
    this.speeds.at(times[k]);
  }
}

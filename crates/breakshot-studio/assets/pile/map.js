/** The map of all strikes: success probability by contact and direction. A line leads to each contact; the likelier, the wider and longer. */

import { along, byId, degrees, fixed, svg } from "/elements.js";
import { addKeys } from "/keys.js";
import { askForJob, follow } from "/server.js";

const CLASSES = 5;
/** Length of a line, least and most (m). */
const LENGTH_M = [0.008, 0.028];

/** Of the strikes along one line the one that succeeds most often. */
function bestOfLines(strikes) {
  const best = new Map();
  for (const one of strikes) {
    const { object, heading_rad, offset_m } = one.aim;
    const line = `${object} ${heading_rad.toFixed(4)} ${offset_m.toFixed(5)}`;
    const known = best.get(line);
    if (!known || one.success_probability > known.success_probability) best.set(line, one);
  }
  return [...best.values()].sort((a, b) => a.success_probability - b.success_probability);
}

export class StrikeMap {
  #pile;
  #message;
  #strikes = [];
  #isRunning = false;

  constructor(pile, message) {
    this.#pile = pile;
    this.#message = message;
    byId("map").addEventListener("click", () => this.toggle());
    addKeys({ title: "The map of strikes", view: "pile" }, [
      [["m"], "show or hide it", () => this.toggle()],
      [["b"], "take its best strike", () => this.#take(this.#strikes.at(-1))],
    ]);
  }

  /** The pile is another one: the map is none of it. */
  clear() {
    this.#strikes = [];
    this.draw();
  }

  async toggle() {
    if (this.#strikes.length) return this.clear();
    const properties = byId("properties").value;
    if (this.#isRunning || !properties || !this.#pile.scene) return null;
    const job = await askForJob("/api/map", { pile: this.#pile.request(), properties }, this.#message);
    if (job === null) return null;
    this.#isRunning = true;
    byId("map").textContent = "Computing the map";
    const asked = JSON.stringify(this.#pile.request());
    return follow(job, (event) => {
      if (event.state === "running") return;
      this.#isRunning = false;
      if (event.state === "failed") this.#message.error(new Error(event.error));
      const isCurrent = asked === JSON.stringify(this.#pile.request());
      this.#strikes = event.state === "done" && isCurrent ? bestOfLines(event.result.strikes) : [];
      this.draw();
    });
  }

  draw() {
    byId("map").textContent = this.#strikes.length ? "Hide map" : "Map of strikes";
    byId("map-key").hidden = !this.#strikes.length;
    this.#pile.table.layer("map").replaceChildren(...this.#strikes.map((one) => this.#line(one)));
  }

  #line(one) {
    const { aim, strike, success_probability: probability } = one;
    const contact = along(strike.start_m, strike.heading_rad, strike.travel_m - aim.follow_through_m);
    const length = LENGTH_M[0] + (LENGTH_M[1] - LENGTH_M[0]) * probability;
    const back = along(contact, strike.heading_rad + Math.PI, length);
    const words = `${fixed(100 * probability)} % at ${fixed(strike.speed_m_s, 2)} m/s, ${fixed(degrees(strike.heading_rad))}\u00b0`;
    const line = svg("path", {
      class: `approach p${Math.min(CLASSES - 1, Math.floor(probability * CLASSES))}`,
      d: this.#pile.table.line([back, contact]), onclick: () => this.#take(one),
    }, svg("title", {}, words));
    return line;
  }

  #take(one) {
    if (!one) return;
    this.#pile.edit();
    this.#pile.setStrike(one.strike);
  }
}

/** A new comparison: film, scene, strike and properties are chosen, and a job writes what `breakshot verify` writes. */

import { byId, fillSelect } from "/elements.js";
import { ask, askForJob, follow } from "/server.js";

export class NewComparison {
  #message;
  #written;
  #job = null;
  #contents = null;

  /** `written(file)` is called with the report of a comparison. */
  constructor(message, written) {
    this.#message = message;
    this.#written = written;
    byId("compare-start").addEventListener("click", () => this.start());
    byId("compare-stop").addEventListener("click", () => this.cancel());
    byId("compare-scene").addEventListener("change", () => this.#fitting());
    document.addEventListener("learned", () => this.#contents && this.show(this.#contents));
  }

  /** Shows the files of a project. */
  show(contents) {
    this.#contents = contents;
    const { films, tracks, scenes, strikes, plans, properties } = contents;
    const scene = byId("compare-scene").value;
    const lists = { "compare-film-file": [...films, ...tracks], "compare-scene": scenes, "compare-strike": [...strikes, ...plans], "compare-properties": properties };
    for (const [id, names] of Object.entries(lists)) {
      const { value } = byId(id);
      fillSelect(byId(id), names.map((name) => [name, name]), names.includes(value) ? value : undefined);
      byId(id).disabled = !names.length;
    }
    byId("compare-start").disabled = this.#job !== null || Object.values(lists).some((names) => !names.length);
    // What a person has chosen stays.
    if (byId("compare-scene").value !== scene) this.#fitting();
  }

  /** Chooses film and strike by the name of the scene, where there are such. */
  #fitting() {
    const stem = byId("compare-scene").value.replace(/\.toml$/, "").replace(/\.scene$/, "");
    for (const id of ["compare-film-file", "compare-strike"]) {
      const list = byId(id);
      const named = [...list.options].find(({ value }) => value.startsWith(`${stem}.`));
      if (named) list.value = named.value;
    }
  }

  async start() {
    if (this.#job !== null || byId("compare-start").disabled) return;
    const [film, scene, strike, properties, output] = ["compare-film-file", "compare-scene", "compare-strike", "compare-properties", "compare-output"].map((id) => byId(id).value);
    const job = await askForJob("/api/compare", { film, scene, strike, properties, output }, this.#message);
    if (job === null) return;
    this.#job = job;
    this.#running(0);
    follow(job, (event) => this.#hear(event).catch(this.#message.error));
  }

  async cancel() {
    if (this.#job !== null) await ask(`/api/jobs/${this.#job}/cancel`, {}).catch(this.#message.error);
  }

  #running(done) {
    byId("compare-start").disabled = done !== null;
    byId("compare-stop").hidden = done === null;
    byId("compare-progress").hidden = done === null;
    if (done !== null) byId("compare-progress").value = done;
  }

  async #hear(event) {
    if (event.state === "running") return this.#running(event.done);
    this.#job = null;
    this.#running(null);
    if (event.state === "cancelled") return this.#message.tell("The comparison was cancelled; nothing was written.");
    if (event.state === "failed") return this.#message.error(new Error(event.error));
    await this.#written(event.result.file);
    return this.#message.tell(`Wrote ${event.result.file}.`);
  }
}

/** The goal of the strike, as fields. */

import { byId, setField } from "/elements.js";

const LENGTHS = { "goal-min": ["min_distance_m"], "goal-mean-from": ["mean_distance_m", 0], "goal-mean-to": ["mean_distance_m", 1], "goal-gap": ["min_gap_m"] };

export class Goal {
  #goal = null;

  /** `changed(goal)` gets every goal that a person enters. */
  constructor(changed) {
    for (const [id, [key, part]] of Object.entries(LENGTHS)) {
      byId(id).addEventListener("change", (event) => {
        const metres = Number(event.target.value) / 1e3;
        if (!(metres >= 0)) return this.show(this.#goal);
        const goal = structuredClone(this.#goal);
        if (part === undefined) goal[key] = metres;
        else goal[key][part] = metres;
        this.#goal = goal;
        return changed(goal);
      });
    }
    byId("goal-inside").addEventListener("change", (event) => {
      this.#goal = { ...this.#goal, inside_workspace: event.target.checked };
      changed(this.#goal);
    });
  }

  show(goal) {
    this.#goal = structuredClone(goal);
    for (const [id, [key, part]] of Object.entries(LENGTHS)) {
      const metres = part === undefined ? goal[key] : goal[key][part];
      setField(byId(id), metres * 1e3, 1);
    }
    byId("goal-inside").checked = goal.inside_workspace;
  }
}

/** The plan of the pile: a job with progress and an end, and its strikes. */

import { byId, degrees, fixed, html } from "/elements.js";
import { addKeys } from "/keys.js";
import { ask, askForJob, follow } from "/server.js";

const OUTCOMES = { found: "\u2713 Found", best_effort: "Best effort", unreachable: "\u2717 Unreachable" };
const WORDS = { poses: "the poses of the objects", strike: "the strike\u2019s speed and heading", friction: "friction on the table", restitution: "restitution", masses: "mass ratios", contacts: "contact friction, tangential restitution and simultaneous impacts" };

const percent = (part) => `${fixed(part * 100)} %`;

function described(title, { object, speed_m_s, heading_rad }, probability) {
  return [
    html("b", {}, title), html("span", { class: "part" }, probability == null ? "" : percent(probability)),
    html("small", {}, `${object ?? "the pile"}, ${fixed(speed_m_s, 2)} m/s, ${fixed(degrees(heading_rad))}\u00b0`),
  ];
}

export class Planner {
  #pile;
  #message;
  #job = null;
  #plan = null;

  constructor(pile, message) {
    this.#pile = pile;
    this.#message = message;
    byId("plan").addEventListener("click", () => this.start());
    byId("cancel").addEventListener("click", () => this.cancel());
    byId("show-plan").addEventListener("click", () => this.#show(this.#plan?.strike));
    byId("show-runner-up").addEventListener("click", () => this.#show(this.#plan?.robustness?.runner_up?.strike));
    addKeys({ title: "The plan", view: "pile" }, [
      [["p"], "plan the strike", () => this.start()],
      [["Escape"], "cancel the plan", () => this.cancel()],
      [["1"], "show the planned strike", () => this.#show(this.#plan?.strike)],
      [["2"], "show the runner-up", () => this.#show(this.#plan?.robustness?.runner_up?.strike)],
    ]);
  }

  async start() {
    if (this.#job !== null || !this.#pile.scene) return;
    const properties = byId("properties").value;
    if (!properties) return this.#message.error(new Error("Choose properties first."));
    this.#job = await askForJob("/api/plan", { pile: this.#pile.request(), properties, output: byId("plan-file").value }, this.#message);
    if (this.#job === null) return null;
    this.#running(0);
    return follow(this.#job, (event) => this.#hear(event));
  }

  async cancel() {
    if (this.#job !== null) await ask(`/api/jobs/${this.#job}/cancel`, {}).catch(this.#message.error);
  }

  #running(done) {
    byId("plan").disabled = done !== null;
    byId("cancel").hidden = done === null;
    byId("progress").hidden = done === null;
    if (done !== null) byId("progress").value = done;
  }

  #hear(event) {
    if (event.state === "running") return this.#running(event.done);
    this.#job = null;
    this.#running(null);
    if (event.state === "done") {
      this.#message.tell(`Wrote ${event.result.file}.`);
      return this.#finished(event.result.plan);
    }
    if (event.state === "cancelled") return this.#message.tell("The plan was cancelled; nothing was written.");
    return this.#message.error(new Error(event.error));
  }

  #finished(plan) {
    this.#plan = plan;
    byId("planned").hidden = false;
    byId("reason").replaceChildren(html("strong", { class: plan.outcome === "found" ? "yes" : "doubt" }, OUTCOMES[plan.outcome]), `: ${plan.reason}.`);
    const runnerUp = plan.robustness?.runner_up;
    byId("show-plan").hidden = !plan.strike;
    byId("show-runner-up").hidden = !runnerUp;
    if (plan.strike) byId("show-plan").replaceChildren(...described("Plan", plan.strike, plan.robustness?.success_probability));
    if (runnerUp) byId("show-runner-up").replaceChildren(...described("Runner-up", runnerUp.strike, runnerUp.success_probability));
    this.#doubts(plan.robustness?.doubts ?? []);
    if (plan.strike) this.#show(plan.strike);
  }

  #doubts(doubts) {
    const gains = doubts.filter(({ gain }) => gain >= 0.005).slice(0, 3);
    byId("doubts").replaceChildren(...(gains.length ? [
      html("p", { class: "quiet" }, "Would succeed more often if this were known:"),
      html("ul", { class: "plain-list" }, ...gains.map(({ source, gain }) => html("li", {}, html("span", { class: "part" }, `+${percent(gain)}`), ` ${WORDS[source] ?? source}`))),
    ] : []));
  }

  #show(strike) {
    if (!strike) return;
    this.#pile.edit();
    this.#pile.setStrike(strike);
  }
}

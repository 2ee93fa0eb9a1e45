/** Plays a simulated motion: at a pace, step by step, from impact to impact. */

import { byId, fixed, html } from "/elements.js";
import { addKeys } from "/keys.js";
import { Playback, changePace, moments, playbackKeys } from "/playback.js";
import { Timeline } from "/timeline.js";

export class Player {
  #playback;
  #timeline;
  #isShown = false;

  /** `changed(time)` is called whenever another instant is shown. */
  constructor(changed) {
    this.#playback = new Playback({
      changed: () => {
        this.#update();
        changed(this.time);
      },
      playing: () => this.#button(),
      pace: () => Number(byId("pace").value),
    });
    this.#timeline = new Timeline(byId("timeline"), this.#playback);
    byId("play").addEventListener("click", () => this.#playback.toggle());
    byId("back").addEventListener("click", () => this.#playback.step(-1));
    byId("forth").addEventListener("click", () => this.#playback.step(1));
    addKeys({ title: "The motion", view: "pile" }, playbackKeys(() => this.#playback, (by) => changePace(byId("pace"), by)));
  }

  get time() {
    return this.#playback.time;
  }

  get isPlaying() {
    return this.#playback.isPlaying;
  }

  /** Shows another motion; its time is kept as far as it lasts. */
  show(trajectory) {
    this.#isShown = trajectory !== null;
    this.#playback.show({ end: trajectory?.duration_s ?? 0, moments: moments(trajectory?.events ?? []) });
    this.#timeline.draw();
  }

  /** Goes to a time. */
  go(time) {
    this.#playback.go(time);
  }

  pause() {
    this.#playback.pause();
  }

  #button() {
    const button = byId("play");
    button.textContent = this.isPlaying ? "Pause" : "Play";
    button.setAttribute("aria-label", button.textContent);
  }

  #update() {
    this.#timeline.update();
    byId("time").textContent = `${fixed(this.time, 3)} s`;
    const { lastImpact, moments: impacts } = this.#playback;
    const words = lastImpact ? `impact ${lastImpact.number} of ${impacts.length}: ${lastImpact.words}` : `${impacts.length} impacts`;
    byId("event").replaceChildren(...(this.#isShown ? [html("span", { class: lastImpact?.isNow ? "now" : "" }, words)] : []));
  }
}

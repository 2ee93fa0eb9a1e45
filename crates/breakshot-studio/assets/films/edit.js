/** Changes of the clip that is open: its objects, what of it is left out, and new films. Each is written at once and can be taken back. */

import { byId, fixed, html, onDrop } from "/elements.js";
import { addKeys } from "/keys.js";
import { ask, read, send } from "/server.js";

const seconds = ([from, until]) => `${fixed(from, 3)} to ${fixed(until, 3)} s`;

export class ClipEdit {
  #message;
  #films;
  #from = null;
  #count = 0;
  /** Changes are made one after the other. */
  #last = Promise.resolve();

  /** `films` has `campaign`, `clip`, `time`, and `reopen(name)`. */
  constructor(message, films) {
    this.#message = message;
    this.#films = films;
    byId("clip-objects").addEventListener("change", () => this.#saveObjects());
    byId("clip-excluded").addEventListener("change", (event) => this.#save({ excluded: event.target.checked }));
    byId("stretch").addEventListener("click", () => this.mark());
    byId("stretch-cancel").addEventListener("click", () => this.#unmark());
    byId("undo").addEventListener("click", () => this.undo());
    byId("add-films").addEventListener("click", () => byId("film-picker").click());
    byId("film-picker").addEventListener("change", (event) => this.#draft([...event.target.files]));
    this.#addDrop();
    addKeys({ title: "The clip", view: "films", isFor: (target) => !target.matches("select, input[type=text]") }, [
      [["s"], "leave out from this frame, and until this frame", () => this.mark()],
      [["x"], "leave out the clip, or take it in again", () => byId("clip-excluded").click()],
      [["f"], "add films", () => byId("add-films").click()],
      [["Ctrl+z"], "take back the last change", () => this.undo()],
      [["Escape"], "no stretch", () => this.#unmark()],
    ]);
  }

  /** Shows what the campaign says of the clip that is open. */
  async show() {
    this.#unmark();
    const { clip, campaign } = this.#films;
    byId("clip-edit").hidden = !clip;
    this.#films.starts.show();
    if (!clip) return;
    byId("clip-objects").value = clip.objects.join(", ");
    byId("clip-excluded").checked = clip.is_excluded;
    byId("stretch").disabled = clip.is_excluded;
    byId("track").disabled = clip.is_excluded;
    const remove = (k) => this.#save({ excluded_s: clip.excluded_s.filter((_, other) => other !== k) });
    byId("stretches").replaceChildren(...clip.excluded_s.map((stretch, k) => html("li", {}, `left out: ${seconds(stretch)}`,
      html("button", { type: "button", class: "icon", "aria-label": `take ${seconds(stretch)} in again`, onclick: () => remove(k) }, "\u00d7"))));
    this.#undoable(await read("/api/edits", { campaign }));
  }

  #undoable(count) {
    this.#count = count;
    byId("undo").disabled = !count;
  }

  /** Begins a stretch at the frame that is shown, or ends it there and leaves it out. */
  mark() {
    const { clip, time } = this.#films;
    if (!clip || clip.is_excluded) return;
    if (this.#from === null) {
      this.#from = time;
      byId("stretch").textContent = `Leave out from ${fixed(time, 3)} s until here`;
      byId("stretch-cancel").hidden = false;
      return;
    }
    const stretch = [Math.min(this.#from, time), Math.max(this.#from, time)];
    if (stretch[0] === stretch[1]) {
      this.#message.error(new Error("The stretch has no length: go to the last frame that is to be left out."));
      return;
    }
    this.#unmark();
    this.#save({ excluded_s: [...clip.excluded_s, stretch] });
  }

  #unmark() {
    this.#from = null;
    byId("stretch").textContent = "Leave out from here";
    byId("stretch-cancel").hidden = true;
  }

  #saveObjects() {
    const objects = byId("clip-objects").value.split(",").map((name) => name.trim()).filter(Boolean);
    this.#save({ objects });
  }

  #inTurn(work) {
    this.#last = this.#last.then(work).catch(this.#message.error);
    return this.#last;
  }

  /** Changes the clip that is open. */
  save(change) {
    return this.#save(change);
  }

  #save(change) {
    const { campaign, clip } = this.#films;
    return this.#inTurn(() => this.#write(campaign, clip, change));
  }

  async #write(campaign, clip, change) {
    try {
      const count = await ask("/api/clip", { campaign, clip: clip.name, ...change });
      this.#undoable(count);
      await this.#films.reopen(clip.name);
      this.#message.tell(`Wrote ${campaign}. ${change.starts ? "Track the clip again" : "Estimate again (Properties)"} to see what it changes.`);
    } catch (error) {
      await this.show().catch(this.#message.error);
      this.#message.error(error);
    }
  }

  /** Takes back the last change of the campaign. */
  undo() {
    return this.#inTurn(async () => {
      if (!this.#count) return;
      const { campaign, clip } = this.#films;
      this.#undoable(await ask("/api/undo", { campaign }));
      await this.#films.reopen(clip?.name);
      this.#message.tell(`Took back the last change of ${campaign}.`);
    });
  }

  #addDrop() {
    onDrop(byId("films"), (files) => this.#draft(files));
  }

  /** Asks for the objects of new films; those in the names of the films are filled in. */
  async #draft(files) {
    byId("film-picker").value = "";
    const { campaign } = this.#films;
    if (!files.length || !campaign) return;
    const rows = [];
    for (const file of files) {
      const drafted = await read("/api/film-draft", { campaign, name: file.name, ...this.#films.firstFields }).catch((error) => ({ error }));
      if (drafted.error) {
        this.#message.error(drafted.error);
        continue;
      }
      const input = html("input", { type: "text", value: drafted.objects.join(", "), spellcheck: "false", required: true });
      rows.push({ file, input, row: html("label", {}, html("span", {}, file.name), input) });
    }
    if (!rows.length) return;
    byId("new-film-list").replaceChildren(...rows.map(({ row }) => row));
    const dialog = byId("new-films");
    dialog.returnValue = "";
    dialog.addEventListener("close", () => dialog.returnValue === "add" && this.#inTurn(() => this.#add(campaign, rows)), { once: true });
    dialog.showModal();
  }

  async #add(campaign, rows) {
    const progress = byId("adding");
    progress.hidden = false;
    let last = null;
    try {
      for (const [k, { file, input }] of rows.entries()) {
        const fields = { campaign, name: file.name, objects: input.value, ...(last ? {} : this.#films.firstFields) };
        const added = await send("/api/upload", fields, file, (done) => { progress.value = (k + done) / rows.length; });
        last = added.name;
        this.#undoable(added.undo);
      }
      this.#message.tell(`Added ${rows.length === 1 ? last : `${rows.length} films`} to ${campaign}.`);
    } catch (error) {
      this.#message.error(error);
    }
    progress.hidden = true;
    if (last) await this.#films.reopen(last, true).catch(this.#message.error);
  }
}

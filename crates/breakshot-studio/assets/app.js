/** Opens the page: the link's token becomes a cookie, then the view starts. */

import { byId } from "/elements.js";
import { startKeys } from "/keys.js";
import { Pile } from "/pile/view.js";
import { ask, read } from "/server.js";

/** Exchanges the token behind `#` for a cookie; it leaves the address at once. */
async function open() {
  const token = location.hash.slice(1);
  if (!token) return;
  history.replaceState(null, "", "/");
  await ask("/session", { token }).catch(() => null);
}

const message = {
  tell(text) {
    byId("message").textContent = text;
    byId("message").hidden = !text;
    byId("message").classList.remove("error");
  },
  error(error) {
    message.tell(error.message);
    byId("message").classList.add("error");
  },
  /** Takes back an error that is no longer one. */
  clear() {
    if (byId("message").classList.contains("error")) message.tell("");
  },
};

async function start() {
  await open();
  const contents = await read("/api/project").catch(() => null);
  if (!contents) {
    byId("closed").hidden = false;
    return;
  }
  byId("project").textContent = contents.name;
  byId("pile").hidden = false;
  startKeys();
  const pile = new Pile(message);
  await pile.start(contents).catch(message.error);
  if (!contents.scenes.length) message.tell("This folder holds no scene. `breakshot init` writes a template, `breakshot look` one from a picture.");
}

start();

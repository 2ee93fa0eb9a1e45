/** What other programs change in the folder shows up: the files are looked at now and then while the page is seen. */

import { read } from "/server.js";

/** Time between two looks (ms). */
const LOOK_MS = 2000;

/** Calls `changed(contents)` when a file was written, added or removed. */
export async function watch(changed) {
  let known = await read("/api/stamp").catch(() => null);
  let isLooking = false;
  const look = async () => {
    if (document.hidden || isLooking) return;
    isLooking = true;
    try {
      const stamp = await read("/api/stamp");
      if (stamp !== known) {
        known = stamp;
        await changed(await read("/api/project"));
      }
    } catch {
      // The program has ended, or is busy: the next look will show.
    }
    isLooking = false;
  };
  setInterval(look, LOOK_MS);
  document.addEventListener("visibilitychange", look);
}

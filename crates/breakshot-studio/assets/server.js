/** Questions to the server. */

/** An answer that says why not. */
export class Refused extends Error {
  constructor(status, reason) {
    super(reason);
    this.status = status;
  }
}

async function answered(response) {
  const value = await response.json();
  if (!response.ok) throw new Refused(response.status, value.error ?? response.statusText);
  return value;
}

/** Reads something; `fields` become the query. */
export async function read(path, fields = {}) {
  const query = new URLSearchParams(fields).toString();
  return answered(await fetch(query ? `${path}?${query}` : path));
}

/** Asks for something to be computed or done. */
export async function ask(path, question) {
  const headers = { "Content-Type": "application/json" };
  return answered(await fetch(path, { method: "POST", headers, body: JSON.stringify(question) }));
}

/** Sends a file; `tell` gets the part that has been sent. */
export function send(path, fields, file, tell) {
  return new Promise((done, failed) => {
    const request = new XMLHttpRequest();
    request.open("POST", `${path}?${new URLSearchParams(fields)}`);
    request.setRequestHeader("Content-Type", "application/octet-stream");
    request.upload.onprogress = ({ loaded, total }) => tell(total ? loaded / total : 0);
    request.onerror = () => failed(new Error("The film was not taken: the connection ended."));
    request.onload = () => {
      const answer = JSON.parse(request.responseText);
      if (request.status === 200) done(answer);
      else failed(new Refused(request.status, answer.error));
    };
    request.send(file);
  });
}

/**
 * Asks one question after the other. Of the questions that come up while one is on its way only the newest is asked, so that answers come in
 * order and none is older than one round trip; the others are dropped unasked.
 */
export class Newest {
  #ask;
  #show;
  #failed;
  #waiting = null;
  #isAsking = false;
  #generation = 0;

  constructor(ask, show, failed) {
    this.#ask = ask;
    this.#show = show;
    this.#failed = failed;
  }

  /** The answer to this question is wanted, and to none before it. */
  want(question) {
    this.#waiting = { question };
    if (!this.#isAsking) this.#work();
  }

  /** No answer is wanted any more. */
  drop() {
    this.#waiting = null;
    this.#generation += 1;
  }

  async #work() {
    this.#isAsking = true;
    while (this.#waiting) {
      const { question } = this.#waiting;
      const generation = this.#generation;
      this.#waiting = null;
      try {
        const answer = await this.#ask(question);
        if (generation === this.#generation) this.#show(answer, question);
      } catch (error) {
        if (generation === this.#generation && !this.#waiting) this.#failed(error, question);
      }
    }
    this.#isAsking = false;
  }
}

/** Starts a job and returns its number; null, with a message that says why, for one that was not started. */
export async function askForJob(path, question, message) {
  try {
    const job = await ask(path, question);
    if (job === null) message.error(new Error("Two jobs are running already: wait for one of them, or cancel it."));
    return job;
  } catch (error) {
    message.error(error);
    return null;
  }
}

/** Follows a job until its end; `tell` gets each event. */
export function follow(number, tell) {
  const events = new EventSource(`/api/jobs/${number}/events`);
  events.onmessage = ({ data }) => {
    const event = JSON.parse(data);
    if (event.state !== "running") events.close();
    tell(event);
  };
}

// Requests to the service that serves this page, and to no other.

export class Refusal extends Error {}

async function asked(path, options) {
  const response = await fetch(path, options);
  const content = await response.json();
  if (!response.ok) throw new Refusal(content.detail);
  return content;
}

export function get(path) {
  return asked(path);
}

export function post(operation, request) {
  return asked(`v1/${operation}`, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(request),
  });
}

// Sends a score file of this machine.
export function send(chosen) {
  return asked("v1/files", { method: "POST", headers: { "Content-Type": "application/octet-stream" }, body: chosen });
}

export function cancel(job) {
  return asked(`v1/jobs/${job}`, { method: "DELETE" });
}

// Returns the last state of a job; calls `onState` with every state.
export function ended(job, onState) {
  return new Promise((resolve, reject) => {
    const events = new EventSource(`v1/jobs/${job}/events`);
    events.addEventListener("progress", (event) => onState(JSON.parse(event.data)));
    events.addEventListener("end", (event) => {
      events.close();
      resolve(JSON.parse(event.data));
    });
    events.onerror = () => {
      events.close();
      get(`v1/jobs/${job}`).then((state) => (state.result || state.problem ? resolve(state) : reject(new Refusal("?"))), reject);
    };
  });
}

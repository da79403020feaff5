// Motions: planned from the place that is shown, and played in the 3-D view.

import { cancel, ended, post } from "./api.js";
import { by, made } from "./panels.js";
import { goalName, goalText, t } from "./texts.js";

const RATE = 15; // frames per second that are fetched; the browser holds each until the next
const MOST = 600; // most frames

// Returns frames of a stop: for each the time [s], the posture, and the goal that the arm goes to or comes from.
export function framesOf(stop) {
  const rate = Math.min(RATE, MOST / Math.max(stop.duration, 1e-3));
  const frames = [];
  let begun = 0;
  for (const { times, positions, velocities, from, to } of stop.segments) {
    let k = 0;
    for (let at = Math.ceil(begun * rate) / rate; at <= begun + times.at(-1); at += 1 / rate) {
      while (k + 2 < times.length && times[k + 1] < at - begun) k++;
      frames.push({ at, joints: between(at - begun, k), goal: to === "rest" ? from : to });
    }
    begun += times.at(-1);

    function between(time, i) {
      const step = times[i + 1] - times[i];
      const s = Math.min(Math.max((time - times[i]) / step, 0), 1);
      const [a, b, c, d] = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2 * step, s * s * (3 - 2 * s), s * s * (s - 1) * step];
      return positions[i].map((q, j) => a * q + b * velocities[i][j] + c * positions[i + 1][j] + d * velocities[i + 1][j]);
    }
  }
  return frames;
}

export class Playing {
  // `shown` returns the request of what is shown and its outcome.
  constructor(view3d, shown, fault) {
    Object.assign(this, { view3d, shown, fault, frames: [], poses: [], at: 0, isPlaying: false });
    by("plan").onclick = () => this.plan().catch(fault);
    by("play").onclick = () => this.play(!this.isPlaying);
    by("time").oninput = () => {
      this.play(false);
      this.show(Number(by("time").value));
    };
  }

  // Ends what is shown: it is of another place.
  clear() {
    this.play(false);
    [this.frames, this.poses] = [[], []];
    by("player").hidden = true;
    by("done").replaceChildren();
    by("planWords").textContent = by("planLimits").textContent = "";
  }

  async plan() {
    this.clear();
    const { request, outcome } = this.shown();
    const number = (this.number = (this.number ?? 0) + 1);
    const job = await post("plan", { file: request.file, configuration: [outcome.configuration] });
    by("planning").hidden = false;
    by("cancelPlan").onclick = () => {
      this.number++;
      cancel(job.job).catch(this.fault);
      by("planning").hidden = true;
      by("planWords").textContent = t("cancelled");
    };
    const done = await ended(job.job, (state) => {
      if (number !== this.number) return;
      const percent = state.total ? Math.round((100 * state.done) / state.total) : 0;
      by("planWords").textContent = state.note ? t("compiling") : state.state === "queued" ? t("waiting") : t("planning", { percent: 10 * Math.floor(percent / 10) });
      by("planning").querySelector("progress").value = percent / 100;
    });
    if (number !== this.number) return;
    by("planning").hidden = true;
    if (!done.result) {
      by("planWords").textContent = done.problem;
      return;
    }
    const [stop] = done.result.stops;
    const list = done.result.results.filter((one) => outcome.goals[one.goal].reached);
    const count = list.filter((one) => one.done).length;
    by("planWords").textContent = t("planned", { count, goals: list.length, seconds: stop.duration.toFixed(0) });
    by("planLimits").textContent = t("planLimits");
    for (const one of list.filter((result) => !result.done)) {
      made("li", t("notDone", { goal: goalName(outcome.goals[one.goal]), reason: t(`motionReasons.${one.reason}`) }), by("done"));
    }
    if (!stop.segments.length) return;
    this.frames = framesOf(stop);
    this.outcome = outcome;
    const found = await post("posture", { ...request, arm: this.frames.map((frame) => frame.joints) });
    if (number !== this.number) return;
    this.poses = found.frames;
    by("time").max = this.frames.length - 1;
    by("player").hidden = false;
    this.show(0);
    this.play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  show(number) {
    this.at = number;
    by("time").value = number;
    const { at, goal } = this.frames[number];
    const words = t("playing", { seconds: at.toFixed(1), goal: goal === "rest" ? "" : goalText(this.outcome.goals[goal]) });
    by("time").setAttribute("aria-valuetext", words);
    by("playWords").textContent = words;
    this.view3d.frame = this.poses[number];
    this.view3d.draw();
  }

  play(isPlaying) {
    this.isPlaying = isPlaying && this.poses.length > 0;
    by("play").textContent = t(this.isPlaying ? "pause" : "play");
    if (!this.isPlaying) return;
    if (this.at >= this.frames.length - 1) this.at = 0;
    const begun = performance.now() / 1000 - this.frames[this.at].at;
    const step = () => {
      if (!this.isPlaying) return;
      const time = performance.now() / 1000 - begun;
      let number = this.at;
      while (number + 1 < this.frames.length && this.frames[number + 1].at <= time) number++;
      if (number !== this.at) this.show(number);
      if (number + 1 < this.frames.length) requestAnimationFrame(step);
      else this.play(false);
    };
    requestAnimationFrame(step);
  }
}
